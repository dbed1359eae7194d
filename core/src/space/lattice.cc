#include "space/lattice.h"

#include <algorithm>

namespace partiemc::space {

std::size_t BrickDirectory::Slot(BrickCoordinate brick) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = HashOf(brick) & mask;
  while (slots_[slot] != kNoIndex && bricks_[slots_[slot]] != brick) slot = (slot + 1) & mask;
  return slot;
}

void BrickDirectory::Clear() {
  bricks_.clear();
  neighbours_.clear();
  std::fill(slots_.begin(), slots_.end(), kNoIndex);
}

void BrickDirectory::FillSlots() {
  std::fill(slots_.begin(), slots_.end(), kNoIndex);
  for (std::uint32_t brick = 0; brick < bricks_.size(); ++brick) {
    slots_[Slot(bricks_[brick])] = brick;
  }
}

std::uint32_t BrickDirectory::Insert(BrickCoordinate brick) {
  if (2 * (bricks_.size() + 1) > slots_.size()) {
    slots_.resize(std::max<std::size_t>(64, 2 * slots_.size()));
    FillSlots();
  }
  std::uint32_t& index = slots_[Slot(brick)];
  if (index == kNoIndex) {
    index = static_cast<std::uint32_t>(bricks_.size());
    bricks_.push_back(brick);
  }
  return index;
}

std::uint32_t BrickDirectory::Find(BrickCoordinate brick) const {
  return slots_.empty() ? kNoIndex : slots_[Slot(brick)];
}

std::uint32_t BrickDirectory::At(std::uint32_t brick, int dx, int dy, int dz) const {
  if (dx >= -1 && dx <= 1 && dy >= -1 && dy <= 1 && dz >= -1 && dz <= 1) {
    return neighbours_[brick][((dz + 1) * 3 + dy + 1) * 3 + dx + 1];
  }
  const BrickCoordinate& at = bricks_[brick];
  return Find({at.z + dz, at.y + dy, at.x + dx});
}

void BrickDirectory::Seal() {
  std::sort(bricks_.begin(), bricks_.end());
  FillSlots();
  BrickNeighbours alone;
  alone.fill(kNoIndex);
  neighbours_.assign(bricks_.size(), alone);
  constexpr int kMiddle = 13;
  // Links to the neighbours that come earlier in the order; links are mutual. They lie in this row
  // and in four others. Bricks are sorted, so the searches in these rows only move forward.
  constexpr std::array<std::array<int, 2>, 4> kRows = {{{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}}};
  std::array<std::uint32_t, kRows.size()> first{};
  for (std::uint32_t brick = 0; brick < bricks_.size(); ++brick) {
    const BrickCoordinate at = bricks_[brick];
    const auto link = [&](std::uint32_t to) {
      const BrickCoordinate& other = bricks_[to];
      const int place = ((other.z - at.z + 1) * 3 + other.y - at.y + 1) * 3 + other.x - at.x + 1;
      neighbours_[brick][place] = to;
      neighbours_[to][2 * kMiddle - place] = brick;
    };
    link(brick);
    if (brick > 0 && bricks_[brick - 1] == BrickCoordinate{at.z, at.y, at.x - 1}) link(brick - 1);
    for (std::size_t row = 0; row < kRows.size(); ++row) {
      const std::int32_t z = at.z + kRows[row][0], y = at.y + kRows[row][1];
      while (bricks_[first[row]] < BrickCoordinate{z, y, at.x - 1}) ++first[row];
      for (std::uint32_t k = first[row]; bricks_[k] <= BrickCoordinate{z, y, at.x + 1}; ++k) {
        link(k);
      }
    }
  }
}

}  // namespace partiemc::space
