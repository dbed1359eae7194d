// Bits of a row of nodes or cells; an index that is none.
#pragma once

#include <cstdint>

namespace partiemc {

/// Marks the index of nothing.
inline constexpr std::uint32_t kNoIndex = 0xffffffff;

/// How many bits are set. Unlike std::popcount, inline on processors that are not known to have an
/// instruction for it: the library's call costs more than the sum.
constexpr int CountBits(std::uint32_t bits) {
  bits -= bits >> 1 & 0x55555555u;
  bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0fu;
  return static_cast<int>(bits * 0x01010101u >> 24);
}

}  // namespace partiemc
