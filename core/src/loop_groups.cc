#include "loop_groups.h"

#include <algorithm>

#include "parallel.h"

namespace partiemc {
namespace {

// Points of a batch: a few hundred microseconds of work.
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

// Deals the loops to batches; returns how many there are.
std::size_t LoopGroups::FillBatches() {
  const auto group_count = groups_.empty() ? 0 : *std::max_element(groups_.begin(), groups_.end());
  batch_of_group_.assign(group_count + 1, 0);
  for (std::size_t loop = 0; loop < groups_.size(); ++loop) {
    batch_of_group_[groups_[loop]] += offsets_[loop + 1] - offsets_[loop];
  }
  std::size_t points_before = 0;
  for (std::uint32_t& batch : batch_of_group_) {
    const std::size_t count = batch;
    batch = static_cast<std::uint32_t>(points_before / kBatchPoints);
    points_before += count;
  }
  const std::size_t batch_count = std::size_t{batch_of_group_.back()} + 1;
  if (batches_.size() < batch_count) batches_.resize(batch_count);
  for (std::size_t k = 0; k < batch_count; ++k) {
    batches_[k].points.clear();
    batches_[k].offsets.assign(1, 0);
  }
  for (std::size_t loop = 0; loop < groups_.size(); ++loop) {
    Batch& batch = batches_[batch_of_group_[groups_[loop]]];
    batch.points.insert(batch.points.end(), points_.begin() + offsets_[loop],
                        points_.begin() + offsets_[loop + 1]);
    batch.offsets.push_back(static_cast<std::uint32_t>(batch.points.size()));
  }
  return batch_count;
}

bool LoopGroups::Triangulate(std::span<const double> points,
                             std::vector<std::uint32_t>& triangles) {
  const std::size_t batch_count = FillBatches();
  Clear();
  ParallelFor(batch_count, [&](std::size_t k) {
    Batch& batch = batches_[k];
    batch.triangles.clear();
    batch.is_done =
        batch.triangulator.Triangulate(points, batch.points, batch.offsets, batch.triangles);
  });
  bool is_done = true;
  for (std::size_t k = 0; k < batch_count; ++k) {
    is_done = is_done && batches_[k].is_done;
    triangles.insert(triangles.end(), batches_[k].triangles.begin(), batches_[k].triangles.end());
  }
  return is_done;
}

}  // namespace partiemc
