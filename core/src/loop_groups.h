// Closed loops in groups that are triangulated apart from each other, in parallel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "triangulate.h"

namespace partiemc {

/// Loops as Triangulator wants them, each in a group. Loops of different groups bound regions that
/// have no inner point in common; a group's loops are all that bound its region.
/// Keeps its memory warm from frame to frame.
class LoopGroups {
 public:
  void Clear();

  /// Adds a point to the loop that is being made.
  void AddPoint(std::uint32_t point) { points_.push_back(point); }
  /// Ends that loop; with `reversed`, its points go the other way round.
  void EndLoop(std::uint32_t group, bool reversed = false);

  /// Appends the triangles of all groups, and forgets the loops. Groups are taken together to
  /// batches of about the same number of points, one after the other, whatever the number of
  /// threads. False if the loops of a group break the requirements of Triangulator.
  bool Triangulate(std::span<const double> points, std::vector<std::uint32_t>& triangles);

 private:
  struct Batch {
    std::vector<std::uint32_t> points, offsets, triangles;
    Triangulator triangulator;
    bool is_done = false;
  };

  std::size_t FillBatches();

  std::vector<std::uint32_t> points_, offsets_;  // Loop k has [offsets_[k], offsets_[k + 1]).
  std::vector<std::uint32_t> groups_;            // By loop.
  std::vector<std::uint32_t> batch_of_group_;    // Number of points first.
  std::vector<Batch> batches_;                   // As many as any frame has had.
};

}  // namespace partiemc
