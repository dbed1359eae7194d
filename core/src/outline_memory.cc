#include "outline_memory.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "cell_mask.h"
#include "id_hash.h"
#include "measure.h"
#include "parallel.h"

namespace partiemc {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Particles this near carry a point of the outline, in spacings.
constexpr double kCarrierReach = 3;
// Those in cells this near an active one are remembered, in spacings: the others would weigh next
// to nothing.
constexpr double kRememberedReach = 2;

// A vertex goes this share of its way to the carried outline, less of a longer way, nothing of one
// as long as the reach, in spacings. More is calmer, rougher, and later to follow what changes
// (core/METHOD.md, "What the memory of the outline is worth").
constexpr double kShare = 0.7;
constexpr double kReach = 1.5;

// Sides longer than this have been torn: nothing was seen of what is between their ends. In
// spacings, or in cells where those are larger.
constexpr double kLongestSide = 2;

// No outline bends more tightly, in 1 / spacings.
constexpr double kMaxCurvature = 2;

// A ring's area is remembered for a shorter time than its shape: it goes back by this share to what
// the frame says, by at most so many spacings along its normals.
constexpr double kAreaShare = 0.7;
constexpr double kMaxAreaShift = 0.25;

// Vertices and points that one task carries, and ids that it looks up.
constexpr std::size_t kPointsOfTask = 256;
constexpr std::size_t kIdsOfTask = 4096;

double SquaredLength(Point v) { return v.x * v.x + v.y * v.y; }

// Of a particle, in cells.
template <typename Reader>
Point PositionOf(const Reader& positions, std::size_t particle, double cell_size) {
  const WorldPosition at = positions[particle];
  return {at.x / cell_size, at.y / cell_size};
}

// Which remembered particles are still there, and where they have gone.
void FindMovers(const VertexInput& input, std::span<const NearParticle> known,
                OutlineMemoryScratch& s) {
  const HashIndex<NearParticle> index(known, s.hash_bucket);
  s.ways.assign(known.size(), {kUnknown, kUnknown});
  VisitPositions(input.frame, input.parameters.plane, [&](const auto& positions) {
    ParallelForRanges(input.frame.ids.size(), kIdsOfTask, [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) {
        const NearParticle* const found = index.Find(HashOf(input.frame.ids[k]));
        if (found == nullptr) continue;
        const Point now = PositionOf(positions, k, input.scale.cell_size);
        s.ways[found - known.data()] = {now.x - found->x, now.y - found->y};
      }
    });
  });
  s.movers.clear();
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (!std::isnan(s.ways[k].x)) s.movers.push_back({{known[k].x, known[k].y}, s.ways[k]});
  }
}

// The points of the last outline in this frame.
void CarryPoints(const KnownOutline& outline, double spacing, OutlineMemoryScratch& s) {
  s.motion.Build(s.movers, kCarrierReach * spacing);
  s.carried.resize(outline.points.size() / 2);
  ParallelForRanges(s.carried.size(), kPointsOfTask, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      s.carried[k] = s.motion.Carry({outline.points[2 * k], outline.points[2 * k + 1]})
                         .value_or(Point{kUnknown, kUnknown});
    }
  });
}

// Sides between carried points, found again by their middles.
void SortSides(const KnownOutline& outline, double spacing, OutlineMemoryScratch& s) {
  s.sides.clear();
  const double longest = kLongestSide * std::max(spacing, 1.0);
  for (std::size_t ring = 0; ring + 1 < outline.offsets.size(); ++ring) {
    const std::size_t first = outline.offsets[ring];
    const std::size_t count = outline.offsets[ring + 1] - first;
    const auto point = [&](std::size_t k) { return s.carried[first + k % count]; };
    for (std::size_t k = 0; k < count; ++k) {
      const Point begin = point(k), end = point(k + 1);
      const Point along{end.x - begin.x, end.y - begin.y};
      const double square = SquaredLength(along);
      if (!(square > 0 && square <= longest * longest)) continue;  // Not of unknown ends, either.
      s.sides.push_back({.at = {begin.x + along.x / 2, begin.y + along.y / 2},
                         .before = point(k + count - 1),
                         .begin = begin,
                         .end = end,
                         .after = point(k + 2)});
    }
  }
  s.sides_by_place.Build(s.sides, kReach * spacing + longest / 2);
}

// Of the circle through three points; 0 where one is unknown.
double CurvatureOf(Point a, Point b, Point c, double limit) {
  const Point ab{b.x - a.x, b.y - a.y}, bc{c.x - b.x, c.y - b.y}, ac{c.x - a.x, c.y - a.y};
  const double lengths =
      std::sqrt(SquaredLength(ab)) * std::sqrt(SquaredLength(bc)) * std::sqrt(SquaredLength(ac));
  if (!(lengths > 0)) return 0;
  return std::clamp(2 * (ab.x * bc.y - ab.y * bc.x) / lengths, -limit, limit);
}

// The way from a vertex to the carried outline that faces as it does.
class WayToOutline {
 public:
  WayToOutline(double spacing, const PointBuckets<CarriedSide>& sides)
      : spacing_(spacing), sides_(sides) {}

  // `normal`: of the vertex, outward. 0 where no side is in reach.
  Point From(Point vertex, Point normal) const {
    double nearest = kReach * spacing_ * kReach * spacing_;
    const double reach_square = nearest;
    const CarriedSide* found = nullptr;
    double at = 0;
    sides_.ForEachNear(vertex, [&](const CarriedSide& side) {
      const Point along{side.end.x - side.begin.x, side.end.y - side.begin.y};
      if (along.y * normal.x - along.x * normal.y <= 0) return;
      const Point arm{vertex.x - side.begin.x, vertex.y - side.begin.y};
      const double share =
          std::clamp((arm.x * along.x + arm.y * along.y) / SquaredLength(along), 0.0, 1.0);
      const double square = SquaredLength({share * along.x - arm.x, share * along.y - arm.y});
      if (!(square < nearest)) return;
      nearest = square;
      found = &side;
      at = share;
    });
    if (found == nullptr) return {};
    const double rest = 1 - nearest / reach_square;
    const Point way = ToArc(*found, at, vertex);
    return {kShare * rest * rest * way.x, kShare * rest * rest * way.y};
  }

 private:
  // To the arc over a side: chords alone would let every round outline shrink.
  Point ToArc(const CarriedSide& side, double at, Point vertex) const {
    const Point along{side.end.x - side.begin.x, side.end.y - side.begin.y};
    const double limit = kMaxCurvature / spacing_;
    const double curvature = (CurvatureOf(side.before, side.begin, side.end, limit) +
                              CurvatureOf(side.begin, side.end, side.after, limit)) /
                             2;
    const double bulge = at * (1 - at) * curvature * std::sqrt(SquaredLength(along)) / 2;
    return {side.begin.x + at * along.x + bulge * along.y - vertex.x,
            side.begin.y + at * along.y - bulge * along.x - vertex.y};
  }

  double spacing_;
  const PointBuckets<CarriedSide>& sides_;
};

// Moves a ring along its normals, most of the way back to the area that it came with.
void ReturnArea(std::span<const double> fresh, std::span<const float> normals, double spacing,
                std::span<double> points) {
  const RingMeasures now = MeasureRing(points);
  if (!(now.perimeter > 0)) return;
  const double limit = kMaxAreaShift * spacing;
  const double shift =
      kAreaShare * std::clamp((MeasureRing(fresh).area - now.area) / now.perimeter, -limit, limit);
  for (std::size_t k = 0; k < points.size(); ++k) points[k] += shift * double{normals[k]};
}

// The cells of a tile that have an active cell within reach.
BitRows CellsNearOutline(const VertexInput& input, std::uint32_t tile) {
  const int reach = static_cast<int>(std::ceil(kRememberedReach * input.scale.spacing));
  CellMask mask = CellsAround(
      input.bins.tiles, tile, reach,
      [&](std::uint32_t of) -> const BitRows& { return input.crossings.tiles[of].active; });
  Widen(mask, reach, reach);
  return CellsOfNeighbour(mask, kOwnPlace);
}

// The particles near the outline, in no order.
template <typename Reader>
void FindNearParticles(const VertexInput& input, const Reader& positions, OutlineMemoryScratch& s,
                       std::vector<NearParticle>& particles) {
  const ParticleBins& bins = input.bins;
  s.is_near.resize(bins.entries.size());
  ParallelFor(static_cast<std::uint32_t>(bins.tiles.size()), [&](std::uint32_t tile) {
    if (bins.CountOf(tile) == 0) return;
    const BitRows cells = CellsNearOutline(input, tile);
    for (std::uint32_t k = bins.offsets[tile]; k < bins.offsets[tile + 1]; ++k) {
      s.is_near[k] = LiesIn(bins.entries[k], cells);
    }
  });
  for (std::uint32_t k = 0; k < bins.entries.size(); ++k) {
    if (!s.is_near[k]) continue;
    const std::uint32_t source = bins.entries[k].source;
    const Point at = PositionOf(positions, source, input.scale.cell_size);
    particles.push_back({HashOf(input.frame.ids[source]), at.x, at.y});
  }
}

}  // namespace

void RecallOutline(const VertexInput& input, const KnownOutline& outline, OutlineMemoryScratch& s,
                   Rings& rings) {
  if (input.frame.ids.empty() || outline.points.empty()) return;
  FindMovers(input, outline.particles, s);
  if (s.movers.empty()) return;
  const double spacing = input.scale.spacing;
  const double cell_size = input.scale.cell_size;
  CarryPoints(outline, spacing, s);
  SortSides(outline, spacing, s);
  const WayToOutline way_to_outline(spacing, s.sides_by_place);
  s.fresh = rings.points;
  ParallelForRanges(rings.PointCount(), kPointsOfTask, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      double* const point = &rings.points[2 * k];
      const Point way =
          way_to_outline.From({point[0] / cell_size, point[1] / cell_size},
                              {double{rings.normals[2 * k]}, double{rings.normals[2 * k + 1]}});
      point[0] += way.x * cell_size;
      point[1] += way.y * cell_size;
    }
  });
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    const std::size_t first = 2 * std::size_t{rings.offsets[ring]};
    const std::size_t count = 2 * std::size_t{rings.offsets[ring + 1]} - first;
    ReturnArea(std::span(s.fresh).subspan(first, count),
               std::span(rings.normals).subspan(first, count), spacing * cell_size,
               std::span(rings.points).subspan(first, count));
  });
}

void RememberOutline(const VertexInput& input, const Rings& rings, OutlineMemoryScratch& s,
                     KnownOutline& outline) {
  outline.Clear();
  if (input.frame.ids.empty() || rings.RingCount() == 0) return;
  const double cell_size = input.scale.cell_size;
  outline.offsets = rings.offsets;
  for (const double coordinate : rings.points) outline.points.push_back(coordinate / cell_size);
  VisitPositions(input.frame, input.parameters.plane, [&](const auto& positions) {
    FindNearParticles(input, positions, s, outline.particles);
  });
  ParallelSort(std::span(outline.particles),
               [](const NearParticle& a, const NearParticle& b) { return a.hash < b.hash; });
}

}  // namespace partiemc
