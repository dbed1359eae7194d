#include "partiemc/validate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/predicates.h"
#include "check/ring_checks.h"
#include "check/side_balance.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

/// A sum whose rounding error does not grow with the number of terms (Neumaier, 1974).
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

/// Twice the area of triangle abc, positive if counter-clockwise. Coordinates are subtracted first,
/// so that triangles far from the origin lose no digits.
double DoubleArea(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
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

/// Compares the areas of rings and triangles. The tolerance is 1e-9 relative, plus the change of
/// the area if every coordinate changes by its last bit.
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

/// Balances the sides of the triangles against the reversed segments of the rings.
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

/// Checks M2 by the sides. CheckAreas accepts a gap and an overlap of the same area; balanced sides
/// exclude both.
absl::Status CheckCover(const SideBalance::Finding& sides) {
  if (!sides.imbalance.has_value()) return absl::OkStatus();
  return Broken("M2: the triangles leave a gap or overlap at (", ShortestNumber(sides.imbalance->x),
                ", ", ShortestNumber(sides.imbalance->y), ")");
}

// --- M4 -----------------------------------------------------------------------------------------

/// Requires: M2. Then there is no T-junction if and only if every side cancels as a whole. At a
/// T-junction, the side that contains the vertex cancels only piece by piece. Conversely, if this
/// side cancelled as a whole, two triangles would share it, and the triangles around the vertex
/// would overlap them.
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

}  // namespace

absl::Status Validate(const Result& result) {
  if (absl::Status status = Validate(result.surface); !status.ok()) return status;
  if (absl::Status status = CheckRings(result.rings); !status.ok()) return status;
  // With Fill::kNone there is no mesh to check.
  return result.mesh == Mesh{} ? absl::OkStatus() : CheckMesh(result, true);
}

absl::Status Validate(const Result& result, Fill fill) {
  if (absl::Status status = Validate(result.surface); !status.ok()) return status;
  if (absl::Status status = CheckRings(result.rings); !status.ok()) return status;
  if (fill == Fill::kNone && result.mesh == Mesh{}) return absl::OkStatus();
  return CheckMesh(result, fill != Fill::kConforming && fill != Fill::kPolygon);
}

std::size_t CountTJunctions(const Result& result) { return BalanceSides(result).t_junctions; }

}  // namespace partiemc
