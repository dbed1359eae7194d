#include "normals.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "parallel.h"

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

constexpr std::uint32_t kNone = 0xffffffff;

// Finds the normals that the cells of `order` had in the frame before: both are in one order.
// Writes the cells' places to `next`.
void MatchPrevious(std::span<const CellNormal> previous, std::span<const std::uint32_t> order,
                   const TileDirectory& directory, const Crossings& crossings,
                   NormalScratch& scratch, std::vector<CellNormal>& next) {
  scratch.previous.assign(crossings.cells.size(), kNone);
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

// Samples F at the middles of up to kQueriesAtOnce segments, with `at_entries` at their entries,
// too.
void SampleAtMiddles(const TileDirectory& directory, const PointField& field, bool at_entries,
                     std::span<CellPlane> planes) {
  std::array<FieldPoints, kQueriesAtOnce> places;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    CellPlane& plane = planes[k];
    const ActiveCell& cell = plane.cell;
    plane.point = {(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
    const LatticePoint origin = CellOrigin(directory, cell);
    const auto in_tile = [&](const LatticePoint& point) {
      return LatticePoint{point.x - origin.x + cell.i, point.y - origin.y + cell.j};
    };
    places[k] = {cell.tile, {in_tile(plane.point), in_tile(plane.entry)}, at_entries ? 2u : 1u};
  }
  std::array<FieldSamples, kQueriesAtOnce> samples;
  field.Sample(std::span(places).first(planes.size()), samples);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const auto& [middle, entry] = samples[k];
    planes[k].value = middle.value;
    planes[k].gradient_x = middle.gradient_x;
    planes[k].gradient_y = middle.gradient_y;
    planes[k].entry_value = entry.value;
    planes[k].entry_gradient_x = entry.gradient_x;
    planes[k].entry_gradient_y = entry.gradient_y;
  }
}

// The paper's representative point (Eq. 4 at the cell's centre) and grad phi there (Eq. 9). Where
// no particle reaches the point the gradient stays 0, hence weak.
void SampleAtMean(const TileDirectory& directory, const PointField& field, CellPlane& plane) {
  const ActiveCell& cell = plane.cell;
  const double centre_x = cell.i + 0.5;
  const double centre_y = cell.j + 0.5;
  const FieldSample centre = field.Sample(cell.tile, centre_x, centre_y);
  const LatticePoint origin = CellOrigin(directory, cell);
  plane.point = {origin.x + 0.5 + centre.mean_x, origin.y + 0.5 + centre.mean_y};
  plane.gradient_x = plane.gradient_y = 0;
  plane.value = centre.value;
  const double mean_x = centre_x + centre.mean_x;
  const double mean_y = centre_y + centre.mean_y;
  const int i = static_cast<int>(std::floor(mean_x));
  const int j = static_cast<int>(std::floor(mean_y));
  const TilePlace place = Normalise(directory, cell.tile, i, j);
  if (place.tile == kNoTile) return;
  const FieldSample mean = field.Sample(place.tile, place.i + (mean_x - i), place.j + (mean_y - j));
  plane.gradient_x = mean.phi_x;
  plane.gradient_y = mean.phi_y;
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
                     const RingTopology& rings, const PointField& field,
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
    return index == kNone ? nullptr : &previous[index];
  };
  planes.resize(rings.segments.size());
  scratch.normal.assign(crossings.cells.size(), {0, 0});
  std::atomic<bool> any_is_weak = false;
  // A few successive planes.
  const auto estimate = [&](std::size_t first, std::size_t count) {
    const std::span<CellPlane> some = std::span(planes).subspan(first, count);
    std::array<std::uint32_t, kQueriesAtOnce> cells;
    for (std::size_t k = 0; k < count; ++k) {
      cells[k] = crossings.segments[rings.segments[first + k]].cell;
      some[k].cell = crossings.cells[cells[k]];
    }
    if (parameters.placement == Placement::kFarthestParticle) {
      for (CellPlane& plane : some) SampleAtMean(bins.tiles, field, plane);
    } else {
      const bool at_entries = parameters.placement == Placement::kVirtualPlane;
      SampleAtMiddles(bins.tiles, field, at_entries, some);
    }
    for (std::size_t k = 0; k < count; ++k) {
      CellPlane& plane = some[k];
      plane.is_weak = plane.gradient_x * plane.gradient_x + plane.gradient_y * plane.gradient_y <
                      kWeakGradientSquare;
      if (plane.is_weak) {
        any_is_weak.store(true, std::memory_order_relaxed);
        continue;
      }
      SetNormal(plane.gradient_x, plane.gradient_y, plane);
      Orient(previous_of(cells[k]), plane);
      Keep(plane.cell, cells[k], plane, scratch);
    }
  };
  ParallelForRanges(planes.size(), kSegmentsAtOnce, [&](std::size_t first, std::size_t last) {
    auto end = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), first);
    for (std::size_t k = first; k < last; ++k) {
      if (k == *end) ++end;
      planes[k].entry = rings.entries[k];
      planes[k].exit = rings.entries[k + 1 == *end ? *(end - 1) : k + 1];
    }
    for (std::size_t k = first; k < last; k += kQueriesAtOnce) {
      estimate(k, std::min(kQueriesAtOnce, last - k));
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
