#include "normals/normals.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "base/bits.h"
#include "base/parallel.h"
#include "frame/placement_traits.h"
#include "normals/farthest_particle.h"
#include "sampler/query_batch.h"

namespace partiemc {
namespace {

// A key that orders cells by row, then column: the order of State::normals. The key does not
// overflow for any row and column of 32 bits.
std::int64_t KeyOf(const CellNormal& normal) {
  constexpr std::int64_t kColumns = std::int64_t{1} << 32;
  return normal.row * kColumns + (normal.column + kColumns / 2);
}

// The position of a cell, without a normal.
CellNormal PositionOfCell(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  return {(tile.x << kTileShift) + cell.i, (tile.y << kTileShift) + cell.j, 0, 0};
}

// Finds the previous normals of the cells of `order` by a merge, since both lists are sorted by
// row. Writes the positions of the cells to `next`.
void MatchPrevious(std::span<const CellNormal> previous, std::span<const std::uint32_t> order,
                   const TileDirectory& directory, const Crossings& crossings,
                   NormalScratch& scratch, std::vector<CellNormal>& next) {
  scratch.previous.assign(crossings.cells.size(), kNoIndex);
  next.resize(order.size());
  std::uint32_t before = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    next[k] = PositionOfCell(directory, crossings.cells[order[k]]);
    const std::int64_t key = KeyOf(next[k]);
    while (before < previous.size() && KeyOf(previous[before]) < key) ++before;
    if (before < previous.size() && KeyOf(previous[before]) == key) {
      scratch.previous[order[k]] = before;
    }
  }
}

void SetNormal(double x, double y, CellPlane& plane) {
  const double length = std::sqrt(x * x + y * y);
  plane.normal_x = x / length;
  plane.normal_y = y / length;
}

// Adds the points of segment k that must be sampled to `groups`: its middle as vertex 2 k + 1, and
// its entry, if requested, as vertex 2 k.
template <typename Groups>
void AddPoints(const TileDirectory& directory, std::size_t k, bool with_entry, CellPlane& plane,
               Groups& groups) {
  const ActiveCell& cell = plane.cell;
  plane.point = {(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
  const Point origin = CellOrigin(directory, cell);
  const auto add = [&](std::size_t vertex, const Point& point) {
    groups.Add(vertex, cell.tile, {point.x - origin.x + cell.i, point.y - origin.y + cell.j});
  };
  if (with_entry) add(2 * k, plane.entry);
  add(2 * k + 1, plane.point);
}

void SetSample(std::size_t vertex, const LevelSetSample& sample, std::span<CellPlane> planes) {
  CellPlane& plane = planes[vertex / 2];
  const bool at_middle = vertex % 2 == 1;
  (at_middle ? plane.value : plane.entry_value) = static_cast<float>(sample.value);
  (at_middle ? plane.gradient_x : plane.entry_gradient_x) = static_cast<float>(sample.gradient_x);
  (at_middle ? plane.gradient_y : plane.entry_gradient_y) = static_cast<float>(sample.gradient_y);
  (at_middle ? plane.size : plane.entry_size) = static_cast<float>(sample.size);
}

// The first segment of the group that contains `segment`.
std::size_t GroupOf(const RingTopology& rings, std::size_t segment) {
  if (segment == rings.segments.size()) return segment;
  const auto end = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), segment);
  const std::size_t first = *(end - 1);
  return first + BeginOfGroup(segment - first);
}

void Orient(const CellNormal* reference, CellPlane& plane) {
  const double along = reference != nullptr
                           ? plane.normal_x * reference->x + plane.normal_y * reference->y
                           : plane.normal_x * plane.OutwardX() + plane.normal_y * plane.OutwardY();
  if (along >= 0) return;
  plane.normal_x = -plane.normal_x;
  plane.normal_y = -plane.normal_y;
}

// One call of EstimateNormals, after previous normals were matched to cells.
class NormalEstimation {
 public:
  NormalEstimation(const NormalInput& input, std::span<const CellNormal> previous,
                   NormalScratch& scratch, std::span<CellPlane> planes)
      : input_(input),
        traits_(TraitsOf(input.parameters.placement)),
        previous_(previous),
        scratch_(scratch),
        planes_(planes) {}

  // Computes the planes of all segments, in parallel. Weak normals are set in a second pass.
  void Run() {
    const RingTopology& rings = input_.topology;
    ParallelForRanges(planes_.size(), kSegmentsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; k += kSegmentsAtOnce) {
        Estimate(GroupOf(rings, k), GroupOf(rings, std::min(k + kSegmentsAtOnce, end)));
      }
    });
    if (!any_is_weak_) return;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      ReplaceWeakNormals(rings.offsets[ring], rings.offsets[ring + 1]);
    }
  }

 private:
  std::uint32_t CellOf(std::size_t segment) const {
    return input_.crossings.segments[input_.topology.segments[segment]].cell;
  }

  // The normal of a cell in the last frame; nullptr if the cell had no normal.
  const CellNormal* PreviousOf(std::uint32_t cell) const {
    const std::uint32_t index = scratch_.previous[cell];
    return index == kNoIndex ? nullptr : &previous_[index];
  }

  // Computes the planes of the segments [first, last), which are whole groups.
  void Estimate(std::size_t first, std::size_t last) {
    const RingTopology& rings = input_.topology;
    // Cells are scattered in memory. Reading all indices first overlaps the cache misses.
    std::array<std::uint32_t, kSegmentsAtOnce + kSegmentsOfGroup> cells;
    std::array<bool, kSegmentsAtOnce + kSegmentsOfGroup> begins_group;
    for (std::size_t k = first; k < last; ++k) cells[k - first] = CellOf(k);
    auto end = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), first);
    for (std::size_t k = first; k < last; ++k) {
      if (k == *end) ++end;
      planes_[k].cell = input_.crossings.cells[cells[k - first]];
      planes_[k].entry = rings.entry_points[k];
      planes_[k].exit = rings.entry_points[k + 1 == *end ? *(end - 1) : k + 1];
      begins_group[k - first] = BeginsGroup(k - *(end - 1));
    }
    if (traits_.takes_particles) {
      const FarthestParticle rule(input_.bins.tiles, input_.field);
      for (std::size_t k = first; k < last; ++k) rule.SampleAtMean(planes_[k]);
    } else {
      auto groups =
          CollectPoints<Point>([&](std::span<const FieldPoints> points) { Sample(points); });
      for (std::size_t k = first; k < last; ++k) {
        if (begins_group[k - first]) groups.Part();
        AddPoints(input_.bins.tiles, k, traits_.refines, planes_[k], groups);
      }
      groups.Finish();
    }
    for (std::size_t k = first; k < last; ++k) SetReliableNormal(cells[k - first], planes_[k]);
  }

  void Sample(std::span<const FieldPoints> groups) {
    std::array<FieldSamples, kQueriesAtOnce> samples;
    input_.field.Sample(groups, samples);
    for (std::size_t q = 0; q < groups.size(); ++q) {
      for (std::size_t k = 0; k < groups[q].count; ++k) {
        SetSample(groups[q].vertices[k], samples[q][k], planes_);
      }
    }
  }

  // Sets the normal of a plane, unless its gradient is weak.
  void SetReliableNormal(std::uint32_t cell, CellPlane& plane) {
    plane.is_weak = plane.gradient_x * plane.gradient_x + plane.gradient_y * plane.gradient_y <
                    kWeakGradientSquare;
    if (plane.is_weak) {
      any_is_weak_.store(true, std::memory_order_relaxed);
      return;
    }
    SetNormal(plane.gradient_x, plane.gradient_y, plane);
    Orient(PreviousOf(cell), plane);
    StoreNormal(cell, plane);
  }

  // Sets the weak normals of the ring with the segments [first, last). Requires: the reliable
  // normals are set.
  void ReplaceWeakNormals(std::size_t first, std::size_t last) {
    const std::span<CellPlane> planes = planes_.subspan(first, last - first);
    const std::size_t count = planes.size();
    for (std::size_t k = 0; k < count; ++k) {
      CellPlane& plane = planes[k];
      if (!plane.is_weak) continue;
      const std::uint32_t cell = CellOf(first + k);
      if (const CellNormal* memory = PreviousOf(cell)) {
        SetNormal(memory->x, memory->y, plane);
      } else {
        double x = 0, y = 0;
        for (const std::size_t near : {(k + count - 1) % count, (k + 1) % count}) {
          if (planes[near].is_weak) continue;
          x += planes[near].normal_x;
          y += planes[near].normal_y;
        }
        if (x * x + y * y < kWeakGradientSquare) {
          x = plane.OutwardX();
          y = plane.OutwardY();
        }
        SetNormal(x, y, plane);
      }
      StoreNormal(cell, plane);
    }
  }

  // Stores a normal for the next frame, unless its cell is a saddle, which has two normals.
  void StoreNormal(std::uint32_t cell, const CellPlane& plane) {
    if (plane.cell.IsSaddle()) return;
    scratch_.normal[cell] = {static_cast<float>(plane.normal_x),
                             static_cast<float>(plane.normal_y)};
  }

  const NormalInput& input_;
  const PlacementTraits& traits_;
  std::span<const CellNormal> previous_;
  NormalScratch& scratch_;
  std::span<CellPlane> planes_;
  std::atomic<bool> any_is_weak_ = false;
};

// Writes the stored normals to `next`, and removes the cells without one.
void WriteNormals(std::span<const std::uint32_t> order, const NormalScratch& scratch,
                  std::vector<CellNormal>& next) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto& [x, y] = scratch.normal[order[k]];
    if (x == 0 && y == 0) continue;
    next[kept++] = {next[k].column, next[k].row, x, y};
  }
  next.resize(kept);
}

}  // namespace

void EstimateNormals(const NormalInput& input, std::span<const CellNormal> previous,
                     NormalScratch& scratch, std::vector<CellPlane>& planes,
                     std::vector<CellNormal>& next) {
  if (!input.parameters.normal_memory) previous = {};
  const Crossings& crossings = input.crossings;
  const std::span<const std::uint32_t> order = scratch.cells_by_row.List(
      input.bins.tiles, crossings, [](const ActiveCell& cell) { return !cell.IsSaddle(); });
  MatchPrevious(previous, order, input.bins.tiles, crossings, scratch, next);
  planes.resize(input.topology.segments.size());
  scratch.normal.assign(crossings.cells.size(), {0, 0});
  NormalEstimation(input, previous, scratch, planes).Run();
  WriteNormals(order, scratch, next);
}

}  // namespace partiemc
