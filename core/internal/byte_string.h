// Writes numbers to strings of bytes and reads them back: the format of states and checkpoints.
// Little-endian on every machine.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace partiemc {

/// Appends a number of 4 or 8 bytes to `bytes`.
template <typename T>
void PutNumber(T value, std::string& bytes) {
  auto bits =
      std::bit_cast<std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>>(value);
  char text[sizeof(T)];
  for (char& byte : text) {
    byte = static_cast<char>(bits & 0xff);
    bits >>= 8;
  }
  bytes.append(text, sizeof(T));
}

/// Removes the first number from `bytes` and returns it. Requires: sizeof(T) bytes.
template <typename T>
T TakeNumber(std::string_view& bytes) {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
  Bits bits = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bits |= static_cast<Bits>(static_cast<unsigned char>(bytes[k])) << (8 * k);
  }
  bytes.remove_prefix(sizeof(T));
  return std::bit_cast<T>(bits);
}

/// 64-bit FNV-1a. Detects accidental damage, not forgery.
inline std::uint64_t ChecksumOf(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) {
    hash = (hash ^ static_cast<unsigned char>(byte)) * 0x00000100000001b3u;
  }
  return hash;
}

}  // namespace partiemc
