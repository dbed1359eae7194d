#include "vertices/thinning.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/point.h"
#include "core/internal/research.h"

namespace partiemc {
namespace {

// A ring keeps its cell vertices unless at least this number remain.
constexpr std::size_t kFewestVertices = 12;
// Columns or rows of cells per kept vertex, at most.
constexpr int kMostCells = 8;
// Dropped cell vertices are at most this far from the chord, in local sizes.
constexpr double kMostDistance = .02;

// The distance of a point from the line through two others; 0 if these coincide.
double DistanceFromLine(const Point& point, const Point& a, const Point& b) {
  const Point chord = Minus(b, a);
  const double length = Length(chord);
  return length > 0 ? std::abs(Cross(chord, Minus(point, a))) / length : 0;
}

void DropEdgeVertices(const VertexInput& input, std::size_t first, std::size_t last,
                      RingVertices& v) {
  const double min_distance = input.variant.constants.thinning_distance * input.scale.spacing;
  for (std::size_t k = first; k < last; k += 2) {
    const Point& a = v.point[(k == first ? last : k) - 1];
    const Point& p = v.point[k];
    const Point& b = v.point[k + 1];
    const Point chord{b.x - a.x, b.y - a.y};
    const double cross = chord.x * (p.y - a.y) - chord.y * (p.x - a.x);
    // At a corner of walls, vertices may coincide.
    v.is_kept[k] = input.variant.steps.edge_vertices && p != a && p != b &&
                   std::abs(cross) >= min_distance * v.SizeOf(k) * std::sqrt(Dot(chord, chord));
    v.is_kept[k + 1] = 1;
  }
}

bool MayDropCellVertices(const VertexInput& input) {
  const ReconstructionParameters& p = input.parameters;
  return p.sizes == Sizes::kOwn && p.boundary == Boundary::kBulk && !p.box &&
         std::ranges::none_of(p.sections, [](const Section& of) { return of.phase.has_value(); });
}

// Drops cell vertices of a ring where particles are larger than cells.
class CellThinner {
 public:
  CellThinner(const VertexInput& input, std::size_t ring, RingVertices& vertices)
      : input_(input),
        first_(input.topology.offsets[ring]),
        count_(input.topology.offsets[ring + 1] - first_),
        v_(vertices) {}

  void Thin() {
    std::size_t marked = 0, start = count_;
    for (std::size_t k = 0; k < count_; ++k) {
      if (!IsMarked(k)) continue;
      ++marked;
      start = std::min(start, k);
    }
    if (marked < kFewestVertices || marked == count_) return;
    std::size_t from = start;
    for (std::size_t k = start + 1; k <= start + count_; ++k) {
      if (!IsMarked(k % count_)) continue;
      if (IsNearlyStraight(from, k)) Drop(from, k);
      from = k;
    }
  }

 private:
  // The vertex on the edge before the cell of the k-th segment, counted around the ring.
  std::size_t EdgeOf(std::size_t k) const { return 2 * (first_ + k % count_); }
  std::size_t CellOf(std::size_t k) const { return EdgeOf(k) + 1; }

  TileCoordinate PlaceOf(std::size_t k) const {
    const ActiveCell& cell = input_.planes[first_ + k % count_].cell;
    const TileCoordinate tile = input_.bins.tiles[cell.tile];
    return {tile.y * kTileSize + cell.j, tile.x * kTileSize + cell.i};
  }

  // Whether the cell of a segment lies in a column, or row, whose vertices are kept.
  bool IsMarked(std::size_t k) const {
    const double size = v_.SizeOf(CellOf(k)) * input_.scale.spacing;
    int cells = 1;
    while (2 * cells <= std::min<double>(size, kMostCells)) cells *= 2;
    const TileCoordinate place = PlaceOf(k);
    const VertexNormal& normal = v_.normal[CellOf(k)];
    const std::int32_t at = std::abs(normal.y) >= std::abs(normal.x) ? place.x : place.y;
    return (at & (cells - 1)) == 0;
  }

  bool IsNearlyStraight(std::size_t from, std::size_t to) const {
    const Point &a = v_.point[CellOf(from)], &b = v_.point[CellOf(to)];
    const TileCoordinate low_high[] = {PlaceOf(from), PlaceOf(to)};
    const auto [left, right] = std::minmax(low_high[0].x, low_high[1].x);
    const auto [low, high] = std::minmax(low_high[0].y, low_high[1].y);
    for (std::size_t k = from + 1; k <= to; ++k) {
      for (const std::size_t vertex : {EdgeOf(k), CellOf(k)}) {
        const double most = kMostDistance * input_.scale.spacing * v_.SizeOf(vertex);
        if (DistanceFromLine(v_.point[vertex], a, b) > most) return false;
      }
      const TileCoordinate at = PlaceOf(k);
      if (at.x < left || at.x > right || at.y < low || at.y > high) return false;
    }
    return true;
  }

  void Drop(std::size_t from, std::size_t to) {
    for (std::size_t k = from + 1; k <= to; ++k) {
      v_.is_kept[EdgeOf(k)] = 0;
      if (k < to) v_.is_kept[CellOf(k)] = 0;
    }
  }

  const VertexInput& input_;
  const std::size_t first_, count_;
  RingVertices& v_;
};

}  // namespace

void ThinRing(const VertexInput& input, std::size_t ring, RingVertices& vertices) {
  DropEdgeVertices(input, 2 * std::size_t{input.topology.offsets[ring]},
                   2 * std::size_t{input.topology.offsets[ring + 1]}, vertices);
  const bool meets_wall = input.walls != nullptr && vertices.meets_wall[ring] != 0;
  if (!meets_wall && MayDropCellVertices(input)) CellThinner(input, ring, vertices).Thin();
}

bool KeepCellVertices(RingVertices& vertices) {
  bool was_dropped = false;
  for (std::size_t k = 1; k < vertices.is_kept.size(); k += 2) {
    was_dropped |= vertices.is_kept[k] == 0;
    vertices.is_kept[k] = 1;
  }
  return was_dropped;
}

}  // namespace partiemc
