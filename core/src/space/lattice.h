// The lattice in space: fixed in world coordinates, sparse, in bricks of 8 x 8 x 8 nodes.
//
// Node (i, j, k) lies at (i, j, k) * cell_size in world coordinates. Brick (x, y, z) owns the 8 x 8
// x 8 nodes from (8 x, 8 y, 8 z) on and the cells whose lowest node it owns. Layer k of a brick is
// a 64-bit word: bit 8 j + i is node or cell (i, j, k) of the brick.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bits.h"

namespace partiemc::space {

inline constexpr int kBrickShift = 3;
inline constexpr int kBrickSize = 1 << kBrickShift;
inline constexpr int kBrickNodes = kBrickSize * kBrickSize * kBrickSize;

/// One bit for each node or cell of a brick, by layer.
using BrickBits = std::array<std::uint64_t, kBrickSize>;

struct BrickCoordinate {
  std::int32_t z = 0, y = 0, x = 0;  // In this order: bricks are sorted by layer, row, column.
  friend auto operator<=>(const BrickCoordinate&, const BrickCoordinate&) = default;
};

/// The bricks around a brick. The brick at the offset (dx, dy, dz), each -1, 0 or 1 brick, has the
/// index ((dz + 1) * 3 + dy + 1) * 3 + dx + 1; 13 is the brick itself. kNoIndex if a brick does not
/// exist. The nodes of such a brick are outside.
using BrickNeighbours = std::array<std::uint32_t, 27>;

/// The bricks of a frame, sorted, with their neighbours.
class BrickDirectory {
 public:
  /// Removes all bricks; keeps the memory.
  void Clear();

  /// Adds a brick if it does not exist. Returns its index, in insertion order.
  std::uint32_t Insert(BrickCoordinate brick);

  /// Sorts the bricks and links neighbours. Indices become positions in the sorted order.
  void Seal();

  std::size_t size() const { return bricks_.size(); }
  std::span<const BrickCoordinate> bricks() const { return bricks_; }
  const BrickCoordinate& operator[](std::size_t brick) const { return bricks_[brick]; }
  const BrickNeighbours& neighbours(std::size_t brick) const { return neighbours_[brick]; }

  /// The index of a brick, or kNoIndex.
  std::uint32_t Find(BrickCoordinate brick) const;

  /// The hash of a brick in the table of bricks.
  static std::uint64_t HashOf(BrickCoordinate brick) {
    return TableHash(std::uint64_t{static_cast<std::uint32_t>(brick.y)} << 32 |
                         static_cast<std::uint32_t>(brick.x),
                     static_cast<std::uint32_t>(brick.z));
  }

  /// The brick at a distance of (dx, dy, dz) bricks from `brick`, or kNoIndex.
  std::uint32_t At(std::uint32_t brick, int dx, int dy, int dz) const;

 private:
  std::size_t Slot(BrickCoordinate brick) const;
  void FillSlots();

  std::vector<BrickCoordinate> bricks_;
  std::vector<BrickNeighbours> neighbours_;
  std::vector<std::uint32_t>
      slots_;  // Open addressing, linear probing; kNoIndex marks a free slot.
};

/// A node or cell: its brick, and its place in the brick, 0 <= i, j, k < 8.
struct BrickPlace {
  std::uint32_t brick;
  int i, j, k;

  int Index() const { return (k * kBrickSize + j) * kBrickSize + i; }
  int Bit() const { return j * kBrickSize + i; }
};

/// The place of the node or cell (i, j, k), which is relative to `brick`, in the brick that owns
/// it; kNoIndex if that brick does not exist. Requires: -8 <= i, j, k < 16.
inline BrickPlace Normalise(const BrickDirectory& directory, std::uint32_t brick, int i, int j,
                            int k) {
  const int dx = i >> kBrickShift, dy = j >> kBrickShift, dz = k >> kBrickShift;
  const std::uint32_t owner =
      (dx | dy | dz) == 0 ? brick
                          : directory.neighbours(brick)[((dz + 1) * 3 + dy + 1) * 3 + dx + 1];
  return {owner, i & (kBrickSize - 1), j & (kBrickSize - 1), k & (kBrickSize - 1)};
}

/// As partiemc::CountBits, for 64 bits.
constexpr int CountBits(std::uint64_t bits) {
  bits -= bits >> 1 & 0x5555555555555555;
  bits = (bits & 0x3333333333333333) + (bits >> 2 & 0x3333333333333333);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0f;
  return static_cast<int>(bits * 0x0101010101010101 >> 56);
}

}  // namespace partiemc::space
