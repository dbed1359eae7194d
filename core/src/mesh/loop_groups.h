// Triangulates groups of closed loops in parallel, each group by itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "mesh/loop_strip.h"
#include "mesh/triangulate.h"

namespace partiemc {

/// Loops in groups. Each loop meets the requirements of Triangulator. The loops of a group are the
/// whole boundary of a region; regions of different groups have no inner point in common. If a
/// group has two loops, a ring and its staircase, LoopStrip (loop_strip.h) is tried first, because
/// it is faster. Reuses its memory.
class LoopGroups {
 public:
  void Clear();

  /// Appends the points [first, last) to the current loop.
  void AddPoints(std::uint32_t first, std::uint32_t last) {
    points_.resize(points_.size() + (last - first));
    std::iota(points_.end() - (last - first), points_.end(), first);
  }
  void AddPoints(std::span<const std::uint32_t> points) {
    points_.insert(points_.end(), points.begin(), points.end());
  }
  /// Ends the current loop and adds it to `group`. `reversed` reverses the direction of the loop.
  void EndLoop(std::uint32_t group, bool reversed = false);

  /// Appends the triangles of all groups, in the order of the groups, and removes the loops. Groups
  /// are combined to batches of about the same number of points, independent of the number of
  /// threads. Returns false if Triangulator finds that the loops of a group break its requirements;
  /// such a group gets no triangles. LoopStrip does not check the requirements.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::vector<std::uint32_t>& triangles);

 private:
  // Successive groups that one task triangulates.
  struct Batch {
    std::size_t first_group = 0, last_group = 0;
    std::vector<std::uint32_t> points, offsets;  // Loops of the current group.
    std::vector<std::uint32_t> triangles;
    LoopStrip strip;
    Triangulator triangulator;
    bool is_complete = true;
  };

  void SortLoops();
  std::size_t MakeBatches();
  std::span<const std::uint32_t> LoopsOf(std::size_t group) const {
    return std::span(loops_).subspan(loop_offsets_[group],
                                     loop_offsets_[group + 1] - loop_offsets_[group]);
  }
  std::span<const std::uint32_t> PointsOf(std::uint32_t loop) const {
    return std::span(points_).subspan(offsets_[loop], offsets_[loop + 1] - offsets_[loop]);
  }
  bool TriangulateGroup(std::span<const double> points, std::size_t group, Batch& batch) const;

  std::vector<std::uint32_t> points_, offsets_;  // Loop k has [offsets_[k], offsets_[k + 1]).
  std::vector<std::uint32_t> groups_;            // By loop.
  std::vector<std::uint32_t> loops_;             // Sorted by group.
  std::vector<std::uint32_t> loop_offsets_;      // By group: its range of loops_.
  std::vector<Batch> batches_;                   // Reused; a frame uses the first ones.
};

}  // namespace partiemc
