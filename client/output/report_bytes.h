// Writes the numbers of a report's geometry.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <utility>

namespace partiemc::client {

/// Counts are LEB128 varints (7 bits per byte, lowest first). Signed numbers have the zigzag
/// encoding (sign in the lowest bit). Float64 is little-endian.
class ReportBytes {
 public:
  void Count(std::uint64_t value) {
    while (value >= 0x80) {
      out_ += static_cast<char>(value | 0x80);
      value >>= 7;
    }
    out_ += static_cast<char>(value);
  }

  void Byte(std::uint8_t value) { out_ += static_cast<char>(value); }

  void Signed(std::int64_t value) {
    Count((static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63));
  }

  void Float64(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 0; shift < 64; shift += 8) out_ += static_cast<char>(bits >> shift);
  }

  /// The number of bytes, then the bytes.
  void Bytes(const std::string& bytes) {
    Count(bytes.size());
    out_ += bytes;
  }

  std::string Take() { return std::move(out_); }

 private:
  std::string out_;
};

}  // namespace partiemc::client
