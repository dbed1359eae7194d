#include "check/ring_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/predicates.h"
#include "mesh/triangulate.h"
#include "vertices/intersections.h"

namespace partiemc {
namespace {

// --- R1 -----------------------------------------------------------------------------------------

absl::Status CheckRingArrays(const Rings& rings) {
  const std::size_t count = rings.RingCount();
  if (rings.points.size() % 2 != 0) {
    return Broken("R1: ring points have ", rings.points.size(), " coordinates, an odd number");
  }
  if (rings.offsets.size() != count + 1 && !(count == 0 && rings.offsets.empty())) {
    return Broken("R1: ", rings.offsets.size(), " ring offsets for ", count, " rings");
  }
  const std::size_t first = rings.offsets.empty() ? 0 : rings.offsets.front();
  const std::size_t last = rings.offsets.empty() ? 0 : rings.offsets.back();
  if (first != 0 || last != rings.PointCount()) {
    return Broken("R1: ring offsets run from ", first, " to ", last, ", not from 0 to ",
                  rings.PointCount());
  }
  if (!std::is_sorted(rings.offsets.begin(), rings.offsets.end())) {
    return Broken("R1: ring offsets descend");
  }
  if (!rings.measures.empty() && rings.measures.size() != count) {
    return Broken("R1: measures of ", rings.measures.size(), " rings for ", count);
  }
  if (!rings.normals.empty() && rings.normals.size() != rings.points.size()) {
    return Broken("R1: ", rings.normals.size(), " components of normals for ", rings.points.size(),
                  " coordinates");
  }
  return absl::OkStatus();
}

/// The ring that point `point` belongs to.
std::size_t RingOf(const Rings& rings, std::size_t point) {
  const auto after = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), point);
  return static_cast<std::size_t>(after - rings.offsets.begin()) - 1;
}

absl::Status CheckR1(const Rings& rings) {
  if (absl::Status status = CheckRingArrays(rings); !status.ok()) return status;
  if (absl::Status status = CheckPoints("R1", rings.points); !status.ok()) return status;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::size_t count = rings.offsets[ring + 1] - rings.offsets[ring];
    if (count < 3) return Broken("R1: ring ", ring, " has ", count, " points");
  }
  const auto point_at = [&](std::size_t i) { return PointAt(rings.points, i); };
  std::vector<std::size_t> order(rings.PointCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (point_at(a) == point_at(b)) return a < b;
    return SweepsBefore(point_at(a), point_at(b));
  });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (point_at(order[i - 1]) != point_at(order[i])) continue;
    // Points of different rings at one place are a touch, R2.
    const std::size_t ring = RingOf(rings, order[i]);
    if (RingOf(rings, order[i - 1]) != ring) continue;
    return Broken("R1: ring ", ring, " has points ", order[i - 1], " and ", order[i],
                  " at the same place");
  }
  return absl::OkStatus();
}

// --- R2, R3 -------------------------------------------------------------------------------------

absl::Status CheckR2(const Rings& rings) {
  TouchingPairsBuffers buffers;
  const std::size_t count = CountTouchingPairs(rings.points, rings.offsets, buffers);
  if (count == 0) return absl::OkStatus();
  return Broken("R2: ", count, " pairs of segments cross or touch, one of them those from point ",
                buffers.example_first, " of ring ", RingOf(rings, buffers.example_first),
                " and from point ", buffers.example_second, " of ring ",
                RingOf(rings, buffers.example_second));
}

/// +1 for a counter-clockwise ring, -1 for a clockwise one. Requires R1 and R2: then the turn at an
/// extreme point is not flat and has the ring's own sense.
int RingOrientation(std::span<const double> ring) {
  const std::size_t count = ring.size() / 2;
  std::size_t lowest = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (SweepsBefore(PointAt(ring, i), PointAt(ring, lowest))) lowest = i;
  }
  return Orientation(PointAt(ring, (lowest + count - 1) % count), PointAt(ring, lowest),
                     PointAt(ring, (lowest + 1) % count));
}

absl::Status CheckR3(const Rings& rings) {
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    const int orientation = RingOrientation(rings.RingPoints(ring));
    if (orientation == (is_outer ? 1 : -1)) continue;
    return Broken("R3: ring ", ring,
                  is_outer ? " is an outer ring, but runs " : " is a hole, but runs ",
                  orientation > 0 ? "counter-clockwise" : "clockwise");
  }
  return absl::OkStatus();
}

// --- R4 -----------------------------------------------------------------------------------------

/// Whether `point`, which is not on the ring, lies inside it: counts the edges to its right.
bool IsInside(std::span<const double> ring, const Point& point) {
  const std::size_t count = ring.size() / 2;
  bool inside = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Point a = PointAt(ring, i);
    const Point b = PointAt(ring, (i + 1) % count);
    if ((a.y <= point.y) == (b.y <= point.y)) continue;
    const bool rises = a.y < b.y;
    if ((Orientation(a, b, point) > 0) == rises) inside = !inside;
  }
  return inside;
}

/// Called when rings are known not to alternate as they should: outer rings lie inside an even
/// number of others, holes inside an odd number. Finds the first that does not. Cost: quadratic.
absl::Status NameMisplacedRing(const Rings& rings) {
  const auto ring_count = rings.RingCount();
  const auto enclosing = [&](std::size_t ring) {
    std::size_t count = 0;
    for (std::size_t other = 0; other < ring_count; ++other) {
      if (other == ring) continue;
      count += IsInside(rings.RingPoints(other), PointAt(rings.RingPoints(ring), 0)) ? 1 : 0;
    }
    return count;
  };
  const auto is_hole = [&](std::size_t ring) { return rings.outer_of[ring] != kNoRing; };
  std::size_t ring = 0;
  while (ring + 1 < ring_count && (enclosing(ring) % 2 == 1) == is_hole(ring)) ++ring;
  return Broken("R4: ring ", ring, is_hole(ring) ? ", a hole," : ", an outer ring,",
                " lies inside ", enclosing(ring), " other rings");
}

/// Disjoint sets of points.
class PointSets {
 public:
  explicit PointSets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0u);
  }
  std::uint32_t Find(std::uint32_t point) {
    while (parents_[point] != point) point = parents_[point] = parents_[parents_[point]];
    return point;
  }
  void Unite(std::uint32_t a, std::uint32_t b) { parents_[Find(a)] = Find(b); }

 private:
  std::vector<std::uint32_t> parents_;
};

/// Requires R1-R3. A hole lies inside an outer ring, with no other ring between, exactly when both
/// bound the same component of the inside, which triangles show.
absl::Status CheckR4(const Rings& rings) {
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t outer = rings.outer_of[ring];
    if (outer == kNoRing) continue;
    if (outer >= rings.RingCount() || rings.outer_of[outer] != kNoRing) {
      return Broken("R4: hole ", ring, " names ring ", outer, ", which is no outer ring");
    }
  }
  std::vector<std::uint32_t> loop_points(rings.PointCount());
  std::iota(loop_points.begin(), loop_points.end(), 0u);
  std::vector<std::uint32_t> triangles;
  if (!Triangulator().Triangulate(rings.points, loop_points, rings.offsets, triangles)) {
    return NameMisplacedRing(rings);
  }
  PointSets components(rings.PointCount());
  for (std::size_t i = 0; i < triangles.size(); i += 3) {
    components.Unite(triangles[i], triangles[i + 1]);
    components.Unite(triangles[i], triangles[i + 2]);
  }
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t outer = rings.outer_of[ring];
    if (outer == kNoRing) continue;
    if (components.Find(rings.offsets[ring]) == components.Find(rings.offsets[outer])) continue;
    return Broken("R4: hole ", ring, " lies in another component than outer ring ", outer,
                  ", which it names");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckPoints(absl::string_view guarantee, std::span<const double> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i]) && InPredicateDomain(points[i])) continue;
    return Broken(guarantee, ": point ", i / 2, " has coordinate ", points[i],
                  ", which is not finite or beyond what can be computed with");
  }
  return absl::OkStatus();
}

absl::Status CheckRings(const Rings& rings) {
  for (const auto check : {CheckR1, CheckR2, CheckR3, CheckR4}) {
    if (absl::Status status = check(rings); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
