// Small functions of numbers that are inlined, and the invalid index kNoIndex.
#pragma once

#include <cmath>
#include <cstdint>

namespace partiemc {

inline constexpr std::uint32_t kNoIndex = 0xffffffff;

/// Counts the set bits. Without a processor instruction for it, std::popcount is a library call
/// that costs more than this sum.
constexpr int CountBits(std::uint32_t bits) {
  bits -= bits >> 1 & 0x55555555u;
  bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0fu;
  return static_cast<int>(bits * 0x01010101u >> 24);
}

/// Equals std::floor, but -0 becomes 0. Without a processor instruction for it, std::floor is a
/// library call, while this function is inlined.
inline double Floor(double value) {
  constexpr double kMostExact = 2147483648;  // 2^31, so that the conversion is defined.
  if (!(value >= -kMostExact && value < kMostExact)) return std::floor(value);
  const auto whole = static_cast<double>(static_cast<std::int32_t>(value));
  return whole - static_cast<double>(whole > value);  // Without a branch.
}

}  // namespace partiemc
