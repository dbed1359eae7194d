// Numbers in the bytes of files.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace partiemc::client::input {

inline constexpr bool kBigEndianMachine = std::endian::native == std::endian::big;

/// The unsigned number in `size` bytes from `at` on. Requires: at + size <= bytes.size().
inline std::uint64_t LittleEndian(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = size; k-- > 0;) {
    value = (value << 8) | static_cast<unsigned char>(bytes[at + k]);
  }
  return value;
}

}  // namespace partiemc::client::input
