// Bit counts of rows of nodes or cells, and the invalid index.
#pragma once

#include <cstdint>

namespace partiemc {

/// The invalid index.
inline constexpr std::uint32_t kNoIndex = 0xffffffff;

/// Counts the set bits. Unlike std::popcount, the function is inlined also on processors without an
/// instruction for it; the library call there costs more than this sum.
constexpr int CountBits(std::uint32_t bits) {
  bits -= bits >> 1 & 0x55555555u;
  bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0fu;
  return static_cast<int>(bits * 0x01010101u >> 24);
}

}  // namespace partiemc
