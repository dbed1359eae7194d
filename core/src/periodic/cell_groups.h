// Groups items by cell, in a grid with few occupied cells.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace partiemc {

using GridCell = std::array<std::int32_t, 3>;

/// Bytes of CellGroups, at most: for each item, and for each occupied cell.
inline constexpr std::uint64_t kBytesPerGroupedItem = 24, kBytesPerCellGroup = 24;

/// The items of each occupied cell. Reuses its memory.
class CellGroups {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Group {
    GridCell cell;
    std::uint32_t first = 0, last = 0;  ///< Its items, [first, last) of items().
  };

  /// Finds the occupied cells and returns their number. `cells`: the cell of each item.
  std::size_t Find(std::span<const GridCell> cells);
  /// Groups the items. Requires: Find was called with the same cells. Cost: linear in items,
  /// n log n in occupied cells.
  void Sort(std::span<const GridCell> cells);

  // After Sort:

  /// In lexicographic order of the cells.
  std::span<const Group> groups() const { return groups_; }
  /// All items, group after group. The items of a group ascend.
  std::span<const std::uint32_t> items() const { return items_; }
  /// The index of the group of a cell; kNone if the cell is not occupied.
  std::uint32_t GroupOf(const GridCell& cell) const;

 private:
  template <typename CellIn>
  std::size_t FindSlot(const GridCell& cell, const CellIn& cell_in) const;

  std::size_t count_ = 0;  // Occupied cells.
  // Hash table of the occupied cells, at most half full: after Find the first item of the cell,
  // after Sort the index of its group.
  std::vector<std::uint32_t> slots_;
  std::vector<std::uint32_t> number_of_;  // By item: number of its cell, in order of first items.
  std::vector<std::uint32_t> place_of_;   // By number: index in `groups_`.
  std::vector<Group> groups_;
  std::vector<std::uint32_t> items_;
};

}  // namespace partiemc
