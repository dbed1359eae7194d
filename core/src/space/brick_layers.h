// Reads layers of the bits of a brick and of the nodes or cells directly around it.
#pragma once

#include <cstdint>
#include <vector>

#include "space/lattice.h"

namespace partiemc::space {

inline constexpr std::uint64_t kFirstColumnOfLayer = 0x0101010101010101;
inline constexpr std::uint64_t kLastColumnOfLayer = 0x8080808080808080;

/// Keeps references to its arguments. Bits of bricks that do not exist are 0.
class BrickLayers {
 public:
  /// `bits` by brick.
  BrickLayers(const BrickDirectory& bricks, const std::vector<BrickBits>& bits, std::uint32_t brick)
      : bricks_(bricks), bits_(bits), brick_(brick) {}

  /// Layer k, shifted: bit 8 j + i of the result is the bit of (i + dx, j + dy, k). Requires: k in
  /// [-1, 8], dx and dy in [-1, 1].
  std::uint64_t operator()(int k, int dx, int dy) const {
    if (dx == 0) return Rows(k, 0, dy);
    const std::uint64_t here = Rows(k, 0, dy), beside = Rows(k, dx, dy);
    return dx > 0 ? (here >> 1 & ~kLastColumnOfLayer) | (beside << 7 & kLastColumnOfLayer)
                  : (here << 1 & ~kFirstColumnOfLayer) | (beside >> 7 & kFirstColumnOfLayer);
  }

 private:
  /// Layer k of the bricks at `bx` bricks along x, with rows shifted by dy.
  std::uint64_t Rows(int k, int bx, int dy) const {
    const std::uint64_t here = Word(bx, 0, k);
    if (dy == 0) return here;
    const std::uint64_t beside = Word(bx, dy, k);
    return dy > 0 ? here >> 8 | beside << 56 : here << 8 | beside >> 56;
  }
  std::uint64_t Word(int bx, int by, int k) const {
    const std::uint32_t owner = bricks_.At(brick_, bx, by, k >> kBrickShift);
    return owner == kNoIndex ? 0 : bits_[owner][k & (kBrickSize - 1)];
  }

  const BrickDirectory& bricks_;
  const std::vector<BrickBits>& bits_;
  const std::uint32_t brick_;
};

}  // namespace partiemc::space
