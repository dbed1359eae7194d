#include "partiemc/validate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "intersections.h"
#include "partiemc/status.h"
#include "point.h"
#include "predicates.h"
#include "side_balance.h"
#include "triangulate.h"

namespace partiemc {
namespace {

template <typename... Parts>
absl::Status Broken(const Parts&... parts) {
  return absl::InternalError(absl::StrCat(parts...));
}

Point PointAt(std::span<const double> points, std::size_t index) {
  return {points[2 * index], points[2 * index + 1]};
}

/// A sum whose error does not grow with the number of terms (Neumaier).
class CompensatedSum {
 public:
  void Add(double term) {
    const double sum = sum_ + term;
    lost_ += std::abs(sum_) >= std::abs(term) ? (sum_ - sum) + term : (term - sum) + sum_;
    sum_ = sum;
  }
  double Value() const { return sum_ + lost_; }

 private:
  double sum_ = 0, lost_ = 0;
};

/// Twice the area of triangle abc, positive when counter-clockwise. Differences come first, so that
/// the distance from the world's origin costs no digits.
double DoubleArea(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

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

absl::Status CheckPoints(absl::string_view guarantee, std::span<const double> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i]) && InPredicateDomain(points[i])) continue;
    return Broken(guarantee, ": point ", i / 2, " has coordinate ", points[i],
                  ", which is not finite or beyond what can be computed with");
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

// --- M1, M3 -------------------------------------------------------------------------------------

absl::Status CheckM1(const Mesh& mesh) {
  if (mesh.points.size() % 2 != 0) {
    return Broken("M1: mesh points have ", mesh.points.size(), " coordinates, an odd number");
  }
  if (mesh.triangles.size() % 3 != 0 || mesh.triangles.size() / 3 != mesh.classes.size()) {
    return Broken("M1: ", mesh.triangles.size(), " indices of triangles for ", mesh.classes.size(),
                  " classes");
  }
  if (absl::Status status = CheckPoints("M1", mesh.points); !status.ok()) return status;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.triangles[i] < mesh.PointCount()) continue;
    return Broken("M1: triangle ", i / 3, " names point ", mesh.triangles[i], " of ",
                  mesh.PointCount());
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const int orientation = Orientation(PointAt(mesh.points, mesh.triangles[i]),
                                        PointAt(mesh.points, mesh.triangles[i + 1]),
                                        PointAt(mesh.points, mesh.triangles[i + 2]));
    if (orientation > 0) continue;
    return Broken("M1: triangle ", i / 3, " is ", orientation < 0 ? "clockwise" : "degenerate");
  }
  return absl::OkStatus();
}

absl::Status CheckM3(const Result& result) {
  const std::vector<double>& ring_points = result.rings.points;
  const std::vector<double>& mesh_points = result.mesh.points;
  if (mesh_points.size() < ring_points.size()) {
    return Broken("M3: the mesh has ", mesh_points.size() / 2, " points, the rings have ",
                  ring_points.size() / 2);
  }
  for (std::size_t i = 0; i < ring_points.size(); ++i) {
    if (std::bit_cast<std::uint64_t>(ring_points[i]) ==
        std::bit_cast<std::uint64_t>(mesh_points[i])) {
      continue;
    }
    return Broken("M3: point ", i / 2, " of the mesh is not that of the rings");
  }
  return absl::OkStatus();
}

// --- M2 -----------------------------------------------------------------------------------------

/// Areas to 1e-9 relative, and what moving every point by the last bit of its coordinates would do.
absl::Status CheckAreas(const Result& result) {
  const Rings& rings = result.rings;
  CompensatedSum ring_area, mesh_area;
  double perimeter = 0;
  double farthest = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::span<const double> points = rings.RingPoints(ring);
    const std::size_t count = points.size() / 2;
    for (std::size_t i = 0; i < count; ++i) {
      const Point a = PointAt(points, i);
      const Point b = PointAt(points, (i + 1) % count);
      ring_area.Add(DoubleArea(PointAt(points, 0), a, b) / 2);
      perimeter += std::abs(b.x - a.x) + std::abs(b.y - a.y);
      farthest = std::max({farthest, std::abs(a.x), std::abs(a.y)});
    }
  }
  for (std::size_t i = 0; i < result.mesh.triangles.size(); i += 3) {
    mesh_area.Add(DoubleArea(PointAt(result.mesh.points, result.mesh.triangles[i]),
                             PointAt(result.mesh.points, result.mesh.triangles[i + 1]),
                             PointAt(result.mesh.points, result.mesh.triangles[i + 2])) /
                  2);
  }
  const double tolerance = 1e-9 * std::abs(ring_area.Value()) +
                           std::numeric_limits<double>::epsilon() * farthest * perimeter;
  if (std::abs(mesh_area.Value() - ring_area.Value()) <= tolerance) return absl::OkStatus();
  return Broken("M2: the triangles cover ", ShortestNumber(mesh_area.Value()),
                ", the rings enclose ", ShortestNumber(ring_area.Value()));
}

/// How the sides of the triangles cancel each other and the segments of the rings run backwards.
SideBalance::Finding BalanceSides(const Result& result) {
  SideBalance sides;
  const Rings& rings = result.rings;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::span<const double> points = rings.RingPoints(ring);
    const std::size_t count = points.size() / 2;
    for (std::size_t i = 0; i < count; ++i) {
      sides.Add(PointAt(points, (i + 1) % count), PointAt(points, i));
    }
  }
  const std::vector<std::uint32_t>& triangles = result.mesh.triangles;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    sides.Add(PointAt(result.mesh.points, triangles[i]),
              PointAt(result.mesh.points, triangles[next]));
  }
  return sides.Take();
}

/// Equal areas leave room for an overlap as large as a gap; balanced sides do not.
absl::Status CheckCover(const SideBalance::Finding& sides) {
  if (!sides.imbalance.has_value()) return absl::OkStatus();
  return Broken("M2: the triangles leave a gap or overlap at (", ShortestNumber(sides.imbalance->x),
                ", ", ShortestNumber(sides.imbalance->y), ")");
}

// --- M4 -----------------------------------------------------------------------------------------

/// Requires M2. Around a vertex inside a side there would be triangles on one side of it and pieces
/// of that side on the other, so that the side does not cancel whole; and where all sides cancel
/// whole, triangles around such a vertex would overlap those at the side.
absl::Status CheckM4(const SideBalance::Finding& sides) {
  if (sides.t_junctions == 0) return absl::OkStatus();
  return Broken("M4: ", sides.t_junctions, " vertices lie inside sides, one of them at (",
                ShortestNumber(sides.t_junction.x), ", ", ShortestNumber(sides.t_junction.y), ")");
}

absl::Status CheckMesh(const Result& result, bool allows_t_junctions) {
  if (absl::Status status = CheckM1(result.mesh); !status.ok()) return status;
  for (const auto check : {CheckM3, CheckAreas}) {
    if (absl::Status status = check(result); !status.ok()) return status;
  }
  const SideBalance::Finding sides = BalanceSides(result);
  if (absl::Status status = CheckCover(sides); !status.ok()) return status;
  return allows_t_junctions ? absl::OkStatus() : CheckM4(sides);
}

absl::Status CheckRings(const Rings& rings) {
  for (const auto check : {CheckR1, CheckR2, CheckR3, CheckR4}) {
    if (absl::Status status = check(rings); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const Result& result) {
  if (absl::Status status = CheckRings(result.rings); !status.ok()) return status;
  // Fill::kNone makes no mesh, whatever the rings.
  return result.mesh == Mesh{} ? absl::OkStatus() : CheckMesh(result, true);
}

absl::Status Validate(const Result& result, Fill fill) {
  if (absl::Status status = CheckRings(result.rings); !status.ok()) return status;
  if (fill == Fill::kNone && result.mesh == Mesh{}) return absl::OkStatus();
  return CheckMesh(result, fill != Fill::kConforming && fill != Fill::kPolygon);
}

std::size_t CountTJunctions(const Result& result) { return BalanceSides(result).t_junctions; }

}  // namespace partiemc
