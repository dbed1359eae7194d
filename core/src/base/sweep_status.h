// The status structure of a plane sweep: the intervals on the sweep line, from left to right, as a
// sequence of identifiers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace partiemc {

/// A sequence of identifiers that the caller keeps sorted: the class does not compare identifiers,
/// and searches with the caller's predicates. A directory lists the short blocks that contain the
/// identifiers. Cost: find log n; insert and erase move at most one block, and sometimes the rest
/// of the directory. Allocates only if there are more blocks than ever before. Not thread-safe.
class SweepStatus {
 public:
  /// A position of an element, or the end. Valid until the next change.
  struct Cursor {
    std::size_t block = 0, slot = 0;
  };

  void Clear() {
    directory_.clear();
    blocks_.clear();
    unused_.clear();
  }

  bool IsEnd(Cursor cursor) const { return cursor.block == directory_.size(); }

  /// Requires: cursor is not the end.
  std::uint32_t At(Cursor cursor) const { return BlockOf(cursor.block).ids[cursor.slot]; }

  /// Requires: cursor is not the end.
  Cursor Next(Cursor cursor) const { return Normalized({cursor.block, cursor.slot + 1}); }

  /// Returns the first element for which `is_before` is false, or the end. Requires: `is_before` is
  /// true for the first elements up to some position, then false. Otherwise the result is some
  /// element for which `is_before` is false, or the end.
  template <typename Predicate>
  Cursor FindFirstNot(const Predicate& is_before) const {
    const auto block =
        std::partition_point(directory_.begin(), directory_.end(), [&](std::uint32_t candidate) {
          const Block& ids = blocks_[candidate];
          return is_before(ids.ids[ids.size - 1]);
        });
    if (block == directory_.end()) return {directory_.size(), 0};
    const Block& found = blocks_[*block];
    // If `is_before` is true for all earlier elements, the last one is the result: the search for
    // the block has tested it.
    const auto slot =
        std::partition_point(found.ids.begin(), found.ids.begin() + (found.size - 1), is_before);
    return {static_cast<std::size_t>(block - directory_.begin()),
            static_cast<std::size_t>(slot - found.ids.begin())};
  }

  /// Inserts an element before `cursor`; returns the new cursor of the element that was there.
  Cursor Insert(Cursor cursor, std::uint32_t id) {
    if (directory_.empty()) directory_.push_back(NewBlock());
    if (IsEnd(cursor)) cursor = {directory_.size() - 1, BlockOf(directory_.size() - 1).size};
    if (BlockOf(cursor.block).size == kBlockSize) cursor = Split(cursor);
    Block& block = BlockOf(cursor.block);
    const auto place = block.ids.begin() + static_cast<std::ptrdiff_t>(cursor.slot);
    std::copy_backward(place, block.ids.begin() + block.size, block.ids.begin() + block.size + 1);
    *place = id;
    ++block.size;
    return Normalized({cursor.block, cursor.slot + 1});
  }

  /// Erases the element at `cursor`; returns the cursor of its successor. Requires: not the end.
  Cursor Erase(Cursor cursor) {
    Block& block = BlockOf(cursor.block);
    const auto place = block.ids.begin() + static_cast<std::ptrdiff_t>(cursor.slot);
    std::copy(place + 1, block.ids.begin() + block.size, place);
    if (--block.size > 0) return Normalized(cursor);
    unused_.push_back(directory_[cursor.block]);
    directory_.erase(directory_.begin() + static_cast<std::ptrdiff_t>(cursor.block));
    return {cursor.block, 0};
  }

 private:
  // A block fills four cache lines. The directory of a hundred thousand intervals has a few
  // thousand entries, so inserting costs about the same in block and directory.
  static constexpr std::uint32_t kBlockSize = 63;

  struct Block {
    std::uint32_t size = 0;
    std::array<std::uint32_t, kBlockSize> ids;
  };

  const Block& BlockOf(std::size_t position) const { return blocks_[directory_[position]]; }
  Block& BlockOf(std::size_t position) { return blocks_[directory_[position]]; }

  Cursor Normalized(Cursor cursor) const {
    if (cursor.slot < BlockOf(cursor.block).size) return cursor;
    return {cursor.block + 1, 0};
  }

  std::uint32_t NewBlock() {
    if (unused_.empty()) {
      blocks_.emplace_back();
      return static_cast<std::uint32_t>(blocks_.size() - 1);
    }
    const std::uint32_t block = unused_.back();
    unused_.pop_back();
    blocks_[block].size = 0;
    return block;
  }

  Cursor Split(Cursor cursor) {
    const std::uint32_t upper_id = NewBlock();
    directory_.insert(directory_.begin() + static_cast<std::ptrdiff_t>(cursor.block) + 1, upper_id);
    Block& lower = BlockOf(cursor.block);
    Block& upper = blocks_[upper_id];
    constexpr std::uint32_t kKept = kBlockSize / 2;
    std::copy(lower.ids.begin() + kKept, lower.ids.end(), upper.ids.begin());
    lower.size = kKept;
    upper.size = kBlockSize - kKept;
    if (cursor.slot <= kKept) return cursor;
    return {cursor.block + 1, cursor.slot - kKept};
  }

  std::vector<std::uint32_t> directory_;  // Blocks in order.
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> unused_;
};

}  // namespace partiemc
