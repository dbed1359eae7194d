#include "space/lattice.h"

#include <algorithm>

namespace partiemc::space {

std::size_t BrickDirectory::Slot(BrickCoordinate brick) const {
  std::uint64_t key = static_cast<std::uint32_t>(brick.x);
  key = key * 0x9e3779b97f4a7c15u + static_cast<std::uint32_t>(brick.y);
  key = key * 0x9e3779b97f4a7c15u + static_cast<std::uint32_t>(brick.z);
  key *= 0x9e3779b97f4a7c15u;
  key ^= key >> 29;
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = key & mask;
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
  for (std::uint32_t brick = 0; brick < bricks_.size(); ++brick) {
    neighbours_[brick][kMiddle] = brick;
    // Finds the neighbours that come earlier in the order. Links are mutual, so later ones follow.
    for (int place = 0; place < kMiddle; ++place) {
      const BrickCoordinate& at = bricks_[brick];
      const std::uint32_t other =
          Find({at.z + place / 9 - 1, at.y + place / 3 % 3 - 1, at.x + place % 3 - 1});
      if (other == kNoIndex) continue;
      neighbours_[brick][place] = other;
      neighbours_[other][2 * kMiddle - place] = brick;
    }
  }
}

}  // namespace partiemc::space
