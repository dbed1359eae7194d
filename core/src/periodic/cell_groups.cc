#include "periodic/cell_groups.h"

#include <algorithm>
#include <bit>

#include "base/bits.h"
#include "base/cancellation.h"

namespace partiemc {
namespace {

bool AreEqual(const GridCell& a, const GridCell& b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

std::uint64_t HashOf(const GridCell& cell) {
  return TableHash(std::uint64_t{static_cast<std::uint32_t>(cell[0])} << 32 |
                       static_cast<std::uint32_t>(cell[1]),
                   static_cast<std::uint32_t>(cell[2]));
}

// Resizes without the surplus of growth by doubling.
void Resize(std::size_t count, std::vector<std::uint32_t>& values) {
  values.reserve(count);
  values.resize(count);
}

}  // namespace

// The slot of a cell, or the empty slot for it. `cell_in(value)`: the cell in a slot.
template <typename CellIn>
std::size_t CellGroups::FindSlot(const GridCell& cell, const CellIn& cell_in) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = HashOf(cell) & mask;
  while (slots_[slot] != kNone && !AreEqual(cell_in(slots_[slot]), cell)) slot = (slot + 1) & mask;
  return slot;
}

std::size_t CellGroups::Find(std::span<const GridCell> cells) {
  const auto cell_in = [&](std::uint32_t item) -> const GridCell& { return cells[item]; };
  slots_.assign(std::bit_ceil(2 * cells.size() + 1), kNone);
  Resize(cells.size(), number_of_);
  count_ = 0;
  for (std::uint32_t item = 0; item < cells.size(); ++item) {
    if (item % kItemsPerCheck == 0) ThrowIfCancelled();
    // Consecutive items often share a cell.
    if (item > 0 && AreEqual(cells[item], cells[item - 1])) {
      number_of_[item] = number_of_[item - 1];
      continue;
    }
    std::uint32_t& first = slots_[FindSlot(cells[item], cell_in)];
    if (first == kNone) {
      first = item;
      number_of_[item] = static_cast<std::uint32_t>(count_++);
    } else {
      number_of_[item] = number_of_[first];
    }
  }
  return count_;
}

void CellGroups::Sort(std::span<const GridCell> cells) {
  groups_.clear();
  groups_.reserve(count_);
  // `first` is the number of the cell until the groups are sorted.
  for (std::size_t item = 0; groups_.size() < count_; ++item) {
    const auto next = static_cast<std::uint32_t>(groups_.size());
    if (number_of_[item] == next) groups_.push_back({.cell = cells[item], .first = next});
  }
  std::ranges::sort(groups_, {}, &Group::cell);
  Resize(count_, place_of_);
  for (std::uint32_t place = 0; place < count_; ++place) place_of_[groups_[place].first] = place;
  for (std::uint32_t& slot : slots_) {
    if (slot != kNone) slot = place_of_[number_of_[slot]];
  }
  // A counting sort: `last` is the number of items, then the end of the items placed so far.
  for (const std::uint32_t number : number_of_) ++groups_[place_of_[number]].last;
  std::uint32_t first = 0;
  for (Group& group : groups_) {
    const std::uint32_t count = group.last;
    group.first = group.last = first;
    first += count;
  }
  Resize(cells.size(), items_);
  for (std::uint32_t item = 0; item < cells.size(); ++item) {
    if (item % kItemsPerCheck == 0) ThrowIfCancelled();
    items_[groups_[place_of_[number_of_[item]]].last++] = item;
  }
}

std::uint32_t CellGroups::GroupOf(const GridCell& cell) const {
  const auto cell_in = [&](std::uint32_t place) -> const GridCell& { return groups_[place].cell; };
  return slots_[FindSlot(cell, cell_in)];
}

}  // namespace partiemc
