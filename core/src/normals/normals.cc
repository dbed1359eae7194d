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

// Orders cells by row, then column, as State::normals are.
std::int64_t KeyOf(const CellNormal& normal) {
  return (std::int64_t{normal.row} << 32) + normal.column;
}

// The place of a cell, without its normal.
CellNormal PlaceOf(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  return {(tile.x << kTileShift) + cell.i, (tile.y << kTileShift) + cell.j, 0, 0};
}

// Finds the normals that the cells of `order` had in the frame before: both are in one order.
// Writes the cells' places to `next`.
void MatchPrevious(std::span<const CellNormal> previous, std::span<const std::uint32_t> order,
                   const TileDirectory& directory, const Crossings& crossings,
                   NormalScratch& scratch, std::vector<CellNormal>& next) {
  scratch.previous.assign(crossings.cells.size(), kNoIndex);
  next.resize(order.size());
  std::uint32_t before = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    next[k] = PlaceOf(directory, crossings.cells[order[k]]);
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

// Collects the middles of segments, of which a plane's vertex is 2 k + 1, and their entries, 2 k.
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
}

// The segment with which the group of a segment begins.
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

// Replaces the weak normals of one ring. Reliable ones were set before. previous_of(segment) is the
// normal of the frame before, or nullptr.
template <typename PreviousOf>
void MendWeakNormals(std::span<const std::uint32_t> segments, PreviousOf previous_of,
                     std::span<CellPlane> planes) {
  const std::size_t count = planes.size();
  for (std::size_t k = 0; k < count; ++k) {
    CellPlane& plane = planes[k];
    if (!plane.is_weak) continue;
    if (const CellNormal* memory = previous_of(segments[k])) {
      SetNormal(memory->x, memory->y, plane);
      continue;
    }
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
}

// Keeps a normal for the next frame, unless its cell has two.
void Keep(const ActiveCell& cell, std::uint32_t index, const CellPlane& plane,
          NormalScratch& scratch) {
  if (cell.IsSaddle()) return;
  scratch.normal[index] = {static_cast<float>(plane.normal_x), static_cast<float>(plane.normal_y)};
}

// Gives the places in `next` their cells' normals; those without one go.
void Remember(std::span<const std::uint32_t> order, const NormalScratch& scratch,
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

void EstimateNormals(const ParticleBins& bins, const Crossings& crossings,
                     const RingTopology& rings, const LevelSetSampler& field,
                     const ReconstructionParameters& parameters,
                     std::span<const CellNormal> previous, NormalScratch& scratch,
                     std::vector<CellPlane>& planes, std::vector<CellNormal>& next) {
  if (!parameters.normal_memory) previous = {};
  // A saddle has two planes and so no normal of its own to remember.
  const std::span<const std::uint32_t> order = scratch.cells_by_row.List(
      bins.tiles, crossings, [](const ActiveCell& cell) { return !cell.IsSaddle(); });
  MatchPrevious(previous, order, bins.tiles, crossings, scratch, next);
  // The normal that a cell had in the frame before, or nullptr.
  const auto previous_of = [&](std::uint32_t cell) {
    const std::uint32_t index = scratch.previous[cell];
    return index == kNoIndex ? nullptr : &previous[index];
  };
  planes.resize(rings.segments.size());
  scratch.normal.assign(crossings.cells.size(), {0, 0});
  std::atomic<bool> any_is_weak = false;
  const auto set_normal = [&](std::uint32_t cell, CellPlane& plane) {
    plane.is_weak = plane.gradient_x * plane.gradient_x + plane.gradient_y * plane.gradient_y <
                    kWeakGradientSquare;
    if (plane.is_weak) {
      any_is_weak.store(true, std::memory_order_relaxed);
      return;
    }
    SetNormal(plane.gradient_x, plane.gradient_y, plane);
    Orient(previous_of(cell), plane);
    Keep(plane.cell, cell, plane, scratch);
  };
  const auto sample = [&](std::span<const FieldPoints> groups) {
    std::array<FieldSamples, kQueriesAtOnce> samples;
    field.Sample(groups, samples);
    for (std::size_t q = 0; q < groups.size(); ++q) {
      for (std::size_t k = 0; k < groups[q].count; ++k) {
        SetSample(groups[q].vertices[k], samples[q][k], planes);
      }
    }
  };
  const PlacementTraits& traits = TraitsOf(parameters.placement);
  const auto estimate = [&](std::size_t first, std::size_t last) {
    // Cells lie anywhere in memory: all are looked up before anything waits for one of them.
    std::array<std::uint32_t, kSegmentsAtOnce + kSegmentsOfGroup> cells;
    std::array<bool, kSegmentsAtOnce + kSegmentsOfGroup> begins_group;
    for (std::size_t k = first; k < last; ++k) {
      cells[k - first] = crossings.segments[rings.segments[k]].cell;
    }
    auto end = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), first);
    for (std::size_t k = first; k < last; ++k) {
      if (k == *end) ++end;
      planes[k].cell = crossings.cells[cells[k - first]];
      planes[k].entry = rings.entry_points[k];
      planes[k].exit = rings.entry_points[k + 1 == *end ? *(end - 1) : k + 1];
      begins_group[k - first] = BeginsGroup(k - *(end - 1));
    }
    if (traits.takes_particles) {
      const FarthestParticle rule(bins.tiles, field);
      for (std::size_t k = first; k < last; ++k) rule.SampleAtMean(planes[k]);
    } else {
      auto groups = CollectPoints<Point>(sample);
      for (std::size_t k = first; k < last; ++k) {
        if (begins_group[k - first]) groups.Part();
        AddPoints(bins.tiles, k, traits.refines, planes[k], groups);
      }
      groups.Finish();
    }
    for (std::size_t k = first; k < last; ++k) set_normal(cells[k - first], planes[k]);
  };
  ParallelForRanges(planes.size(), kSegmentsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; k += kSegmentsAtOnce) {
      estimate(GroupOf(rings, k), GroupOf(rings, std::min(k + kSegmentsAtOnce, end)));
    }
  });
  if (any_is_weak) {
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const std::size_t first = rings.offsets[ring];
      const std::size_t count = rings.offsets[ring + 1] - first;
      MendWeakNormals(
          std::span(rings.segments).subspan(first, count),
          [&](std::uint32_t segment) { return previous_of(crossings.segments[segment].cell); },
          std::span(planes).subspan(first, count));
    }
    for (std::size_t k = 0; k < planes.size(); ++k) {
      if (!planes[k].is_weak) continue;
      const std::uint32_t index = crossings.segments[rings.segments[k]].cell;
      Keep(planes[k].cell, index, planes[k], scratch);
    }
  }
  Remember(order, scratch, next);
}

}  // namespace partiemc
