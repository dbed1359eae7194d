#include "normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "cells_by_row.h"
#include "parallel.h"

namespace partiemc {
namespace {

auto KeyOf(const CellNormal& normal) { return std::tuple(normal.row, normal.column); }

CellNormal KeyOf(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  CellNormal key;
  key.column = (tile.x << kTileShift) + cell.i;
  key.row = (tile.y << kTileShift) + cell.j;
  return key;
}

constexpr std::uint32_t kNone = 0xffffffff;

// Finds the normals that cells had in the frame before: both are in one order. A saddle has two
// planes and so no normal of its own to remember.
void MatchPrevious(std::span<const CellNormal> previous, const TileDirectory& directory,
                   const Crossings& crossings, NormalScratch& scratch) {
  scratch.previous.assign(crossings.cells.size(), kNone);
  std::uint32_t next = 0;
  for (const std::uint32_t index : scratch.order) {
    const ActiveCell& cell = crossings.cells[index];
    const auto key = KeyOf(KeyOf(directory, cell));
    while (next < previous.size() && KeyOf(previous[next]) < key) ++next;
    if (next == previous.size()) return;
    if (KeyOf(previous[next]) == key && !cell.IsSaddle()) scratch.previous[index] = next;
  }
}

void SetNormal(double x, double y, CellPlane& plane) {
  const double length = std::sqrt(x * x + y * y);
  plane.normal_x = x / length;
  plane.normal_y = y / length;
}

// Samples F at the middle of a segment, with `at_entry` at its entry, too.
void SampleAtMiddle(const TileDirectory& directory, const PointField& field, const ActiveCell& cell,
                    bool at_entry, CellPlane& plane) {
  plane.point = {(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
  const LatticePoint origin = CellOrigin(directory, cell);
  const auto in_tile = [&](const LatticePoint& point) {
    return LatticePoint{point.x - origin.x + cell.i, point.y - origin.y + cell.j};
  };
  const LatticePoint middle = in_tile(plane.point);
  const auto set_middle = [&plane](const FieldSample& sample) {
    plane.value = sample.value;
    plane.gradient_x = sample.gradient_x;
    plane.gradient_y = sample.gradient_y;
  };
  if (!at_entry) return set_middle(field.Sample(cell.tile, middle.x, middle.y));
  const auto samples = field.SampleTwo(cell.tile, {middle, in_tile(plane.entry)});
  set_middle(samples[0]);
  plane.entry_value = samples[1].value;
  plane.entry_gradient_x = samples[1].gradient_x;
  plane.entry_gradient_y = samples[1].gradient_y;
}

// The paper's representative point (Eq. 4 at the cell's centre) and grad phi there (Eq. 9). Where
// no particle reaches the point the gradient stays 0, hence weak.
void SampleAtMean(const TileDirectory& directory, const PointField& field, const ActiveCell& cell,
                  CellPlane& plane) {
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

// The cell normals to remember, one for each cell with one segment.
void Remember(const TileDirectory& directory, const Crossings& crossings, const RingTopology& rings,
              std::span<const CellPlane> planes, NormalScratch& scratch,
              std::vector<CellNormal>& next) {
  scratch.plane.assign(crossings.cells.size(), kNone);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    scratch.plane[crossings.segments[rings.segments[k]].cell] = static_cast<std::uint32_t>(k);
  }
  next.clear();
  for (const std::uint32_t index : scratch.order) {
    const std::uint32_t plane = scratch.plane[index];
    if (plane == kNone || crossings.cells[index].IsSaddle()) continue;
    CellNormal normal = KeyOf(directory, crossings.cells[index]);
    normal.x = static_cast<float>(planes[plane].normal_x);
    normal.y = static_cast<float>(planes[plane].normal_y);
    next.push_back(normal);
  }
}

}  // namespace

void EstimateNormals(const ParticleBins& bins, const Crossings& crossings,
                     const RingTopology& rings, const PointField& field,
                     const ReconstructionParameters& parameters,
                     std::span<const CellNormal> previous, NormalScratch& scratch,
                     std::vector<CellPlane>& planes, std::vector<CellNormal>& next) {
  if (!parameters.normal_memory) previous = {};
  scratch.order.clear();
  ForEachCellByRow(bins.tiles, crossings, scratch.next_cell,
                   [&](std::uint32_t cell) { scratch.order.push_back(cell); });
  MatchPrevious(previous, bins.tiles, crossings, scratch);
  // The normal that a segment's cell had in the frame before, or nullptr.
  const auto previous_of = [&](std::uint32_t segment) {
    const std::uint32_t index = scratch.previous[crossings.segments[segment].cell];
    return index == kNone ? nullptr : &previous[index];
  };
  planes.resize(rings.segments.size());
  const auto estimate = [&](std::size_t k) {
    CellPlane& plane = planes[k];
    const std::uint32_t segment = rings.segments[k];
    const ActiveCell& cell = crossings.cells[crossings.segments[segment].cell];
    if (parameters.placement == Placement::kFarthestParticle) {
      SampleAtMean(bins.tiles, field, cell, plane);
    } else {
      const bool at_entry = parameters.placement == Placement::kVirtualPlane;
      SampleAtMiddle(bins.tiles, field, cell, at_entry, plane);
    }
    plane.is_weak = plane.gradient_x * plane.gradient_x + plane.gradient_y * plane.gradient_y <
                    kWeakGradientSquare;
    if (plane.is_weak) return;
    SetNormal(plane.gradient_x, plane.gradient_y, plane);
    Orient(previous_of(segment), plane);
  };
  ParallelForRanges(planes.size(), kSegmentsAtOnce, [&](std::size_t first, std::size_t last) {
    auto end = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), first);
    for (std::size_t k = first; k < last; ++k) {
      if (k == *end) ++end;
      planes[k].entry = rings.entries[k];
      planes[k].exit = rings.entries[k + 1 == *end ? *(end - 1) : k + 1];
      estimate(k);
    }
  });
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::size_t first = rings.offsets[ring];
    const std::size_t count = rings.offsets[ring + 1] - first;
    MendWeakNormals(std::span(rings.segments).subspan(first, count), previous_of,
                    std::span(planes).subspan(first, count));
  }
  Remember(bins.tiles, crossings, rings, planes, scratch, next);
}

}  // namespace partiemc
