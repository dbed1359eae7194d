#include "mesh/loop_groups.h"

#include <algorithm>
#include <numeric>

#include "base/cancellation.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

// Smallest number of points of a batch: a few hundred microseconds of work.
constexpr std::size_t kBatchPoints = 2048;

}  // namespace

void LoopGroups::Clear() {
  points_.clear();
  offsets_.assign(1, 0);
  groups_.clear();
}

void LoopGroups::EndLoop(std::uint32_t group, bool reversed) {
  if (reversed) std::reverse(points_.begin() + offsets_.back(), points_.end());
  offsets_.push_back(static_cast<std::uint32_t>(points_.size()));
  groups_.push_back(group);
}

// Sorts the loops by group, stably.
void LoopGroups::SortLoops() {
  const std::size_t group_count =
      groups_.empty() ? 0 : std::size_t{*std::max_element(groups_.begin(), groups_.end())} + 1;
  // Counting sort. Counts are stored two elements further, so that loop_offsets_[k + 1] is first
  // the start of group k and, after its loops were placed, its end.
  loop_offsets_.assign(group_count + 2, 0);
  for (const std::uint32_t group : groups_) ++loop_offsets_[group + 2];
  std::partial_sum(loop_offsets_.begin(), loop_offsets_.end(), loop_offsets_.begin());
  loops_.resize(groups_.size());
  for (std::uint32_t loop = 0; loop < groups_.size(); ++loop) {
    loops_[loop_offsets_[groups_[loop] + 1]++] = loop;
  }
  loop_offsets_.pop_back();
}

// Divides the groups into batches; returns the number of batches.
std::size_t LoopGroups::MakeBatches() {
  std::size_t count = 0;
  std::size_t points = kBatchPoints;  // In the last batch.
  for (std::size_t group = 0; group + 1 < loop_offsets_.size(); ++group) {
    if (points >= kBatchPoints) {
      if (count == batches_.size()) batches_.emplace_back();
      batches_[count++].first_group = group;
      points = 0;
    }
    batches_[count - 1].last_group = group + 1;
    for (const std::uint32_t loop : LoopsOf(group)) points += PointsOf(loop).size();
  }
  return count;
}

bool LoopGroups::TriangulateGroup(std::span<const double> points, std::size_t group,
                                  Batch& batch) const {
  const std::span<const std::uint32_t> loops = LoopsOf(group);
  const auto strip = [&](std::uint32_t loop, std::uint32_t other) {
    return batch.strip.Triangulate(points, PointsOf(loop), PointsOf(other), batch.triangles);
  };
  // Exchanging the loops reverses the direction of the walkers. An obstacle, such as a pocket of
  // the ring, rarely stops walkers in both directions. In one direction, it stops them from any
  // start.
  if (loops.size() == 2 && (strip(loops[0], loops[1]) || strip(loops[1], loops[0]))) return true;
  batch.points.clear();
  batch.offsets.assign(1, 0);
  for (const std::uint32_t loop : loops) {
    const std::span<const std::uint32_t> loop_points = PointsOf(loop);
    batch.points.insert(batch.points.end(), loop_points.begin(), loop_points.end());
    batch.offsets.push_back(static_cast<std::uint32_t>(batch.points.size()));
  }
  return batch.triangulator.Triangulate(points, batch.points, batch.offsets, batch.triangles);
}

bool LoopGroups::Triangulate(std::span<const double> points,
                             std::vector<std::uint32_t>& triangles) {
  SortLoops();
  const std::size_t batch_count = MakeBatches();
  ParallelFor(batch_count, [&](std::size_t k) {
    Batch& batch = batches_[k];
    batch.triangles.clear();
    batch.is_complete = true;
    for (std::size_t group = batch.first_group; group < batch.last_group; ++group) {
      ThrowIfCancelled();
      batch.is_complete &= TriangulateGroup(points, group, batch);
    }
  });
  bool is_complete = true;
  for (std::size_t k = 0; k < batch_count; ++k) {
    is_complete &= batches_[k].is_complete;
    triangles.insert(triangles.end(), batches_[k].triangles.begin(), batches_[k].triangles.end());
  }
  Clear();
  return is_complete;
}

}  // namespace partiemc
