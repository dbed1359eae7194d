#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "base/predicates_in_space.h"
#include "base/vec3.h"
#include "check/ring_checks.h"
#include "check/shell_nesting.h"
#include "check/triangle_contact.h"
#include "check/triangle_grid.h"
#include "partiemc/status.h"
#include "partiemc/surface.h"

namespace partiemc {
namespace {

Triangle TriangleAt(const Surface& surface, std::size_t triangle) {
  const std::uint32_t* const first = surface.triangles.data() + 3 * triangle;
  return {first[0], first[1], first[2]};
}

// --- S5: sizes, which the other checks rely on --------------------------------------------------

absl::Status CheckOffsets(const char* of, const std::vector<std::uint32_t>& offsets,
                          std::size_t shells, std::size_t count) {
  if (offsets.size() != shells + 1 || offsets.front() != 0 || offsets.back() != count) {
    return Broken("S5: ", offsets.size(), " offsets of ", of, " do not fit ", shells,
                  " shells and ", count, " ", of);
  }
  for (std::size_t k = 0; k < shells; ++k) {
    if (offsets[k] >= offsets[k + 1]) return Broken("S5: shell ", k, " has no ", of);
  }
  return absl::OkStatus();
}

absl::Status CheckSizes(const Surface& surface) {
  const std::size_t shells = surface.ShellCount();
  if (surface.points.size() % 3 != 0 || surface.triangles.size() % 3 != 0) {
    return Broken("S5: ", surface.points.size(), " coordinates and ", surface.triangles.size(),
                  " indices are no multiples of 3");
  }
  if (surface.normals.size() != surface.points.size() || surface.measures.size() != shells) {
    return Broken("S5: ", surface.normals.size(), " components of normals for ",
                  surface.points.size(), " coordinates, ", surface.measures.size(),
                  " measures for ", shells, " shells");
  }
  absl::Status status = CheckOffsets("points", surface.point_offsets, shells, surface.PointCount());
  status.Update(
      CheckOffsets("triangles", surface.triangle_offsets, shells, surface.TriangleCount()));
  return status;
}

absl::Status CheckCoordinates(const Surface& surface) {
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    if (InSpaceDomain(surface.points[i])) continue;
    return Broken("S3: point ", i / 3, " has coordinate ", surface.points[i],
                  ", which is not finite or outside the range of exact arithmetic");
  }
  return absl::OkStatus();
}

/// Checks that each triangle has three different points of its shell.
absl::Status CheckIndices(const Surface& surface) {
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    for (std::size_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
         ++t) {
      const Triangle triangle = TriangleAt(surface, t);
      for (int k = 0; k < 3; ++k) {
        if (triangle[k] < surface.point_offsets[shell] ||
            triangle[k] >= surface.point_offsets[shell + 1]) {
          return Broken("S2: triangle ", t, " of shell ", shell, " has point ", triangle[k],
                        ", which is not the shell's");
        }
        if (triangle[k] == triangle[(k + 1) % 3]) {
          return Broken("S3: triangle ", t, " has point ", triangle[k], " twice");
        }
      }
    }
  }
  return absl::OkStatus();
}

// --- S1, S2 -------------------------------------------------------------------------------------

struct Side {
  std::uint32_t from, to;
  std::uint32_t triangle;
  std::uint32_t opposite = 0;  // Index of the reversed side in the sorted list.

  friend bool operator<(const Side& a, const Side& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  }
};

/// Sorts the sides and links opposite ones.
absl::Status LinkSides(const Surface& surface, std::vector<Side>& sides) {
  sides.reserve(surface.triangles.size());
  for (std::uint32_t t = 0; t < surface.TriangleCount(); ++t) {
    const Triangle triangle = TriangleAt(surface, t);
    for (int k = 0; k < 3; ++k) sides.push_back({triangle[k], triangle[(k + 1) % 3], t});
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t k = 0; k < sides.size(); ++k) {
    Side& side = sides[k];
    if (k > 0 && !(sides[k - 1] < side)) {
      return Broken("S1: triangles ", sides[k - 1].triangle, " and ", side.triangle,
                    " both run from point ", side.from, " to ", side.to);
    }
    const Side reversed{side.to, side.from, 0};
    const auto opposite = std::lower_bound(sides.begin(), sides.end(), reversed);
    if (opposite == sides.end() || reversed < *opposite) {
      return Broken("S1: the edge from point ", side.from, " to ", side.to, " of triangle ",
                    side.triangle, " has no other triangle");
    }
    side.opposite = static_cast<std::uint32_t>(opposite - sides.begin());
  }
  return absl::OkStatus();
}

/// Checks that the triangles around each point form one cycle: steps from triangle to neighbour
/// around the point visit all of them. Requires: S1.
absl::Status CheckLinks(const Surface& surface, const std::vector<Side>& sides) {
  const auto side_of = [&](std::uint32_t from, std::uint32_t to) {
    return std::lower_bound(sides.begin(), sides.end(), Side{from, to, 0});
  };
  std::uint32_t next_point = 0;
  for (std::size_t first = 0; first < sides.size();) {
    const std::uint32_t point = sides[first].from;
    if (point != next_point) return Broken("S2: point ", next_point, " has no triangle");
    ++next_point;
    std::size_t last = first;
    while (last < sides.size() && sides[last].from == point) ++last;
    std::size_t visited = 0;
    std::size_t side = first;
    do {
      // The side of the same triangle that ends in the point, reversed.
      const Triangle triangle = TriangleAt(surface, sides[side].triangle);
      const int corner =
          static_cast<int>(std::find(triangle.begin(), triangle.end(), point) - triangle.begin());
      side = side_of(triangle[(corner + 2) % 3], point)->opposite;
      ++visited;
    } while (side != first && visited <= last - first);
    if (visited != last - first) {
      return Broken("S2: the ", last - first, " triangles around point ", point,
                    " are not one cycle");
    }
    first = last;
  }
  if (next_point != surface.PointCount()) {
    return Broken("S2: point ", next_point, " has no triangle");
  }
  return absl::OkStatus();
}

/// Checks that all triangles of a shell are connected. Requires: S1.
absl::Status CheckConnected(const Surface& surface, const std::vector<Side>& sides) {
  std::vector<std::uint32_t> parent(surface.PointCount());
  for (std::uint32_t k = 0; k < parent.size(); ++k) parent[k] = k;
  const auto root_of = [&](std::uint32_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  for (const Side& side : sides) parent[root_of(side.from)] = root_of(side.to);
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const std::uint32_t first = surface.point_offsets[shell];
    for (std::uint32_t k = first; k < surface.point_offsets[shell + 1]; ++k) {
      if (root_of(k) == root_of(first)) continue;
      return Broken("S2: shell ", shell, " is not connected at point ", k);
    }
  }
  return absl::OkStatus();
}

// --- S3 -----------------------------------------------------------------------------------------

absl::Status CheckCollisions(const Surface& surface) {
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    const Triangle triangle = TriangleAt(surface, t);
    if (!AreCollinear(Vec3At(surface.points, triangle[0]), Vec3At(surface.points, triangle[1]),
                      Vec3At(surface.points, triangle[2]))) {
      continue;
    }
    return Broken("S3: triangle ", t, " is degenerate");
  }
  const TriangleGrid grid(surface.points, surface.triangles);
  absl::Status status;
  grid.ForEachPair([&](std::uint32_t a, std::uint32_t b) {
    if (!TrianglesCollide(surface.points, TriangleAt(surface, a), TriangleAt(surface, b))) {
      return true;
    }
    status = Broken("S3: triangles ", a, " and ", b, " intersect");
    return false;
  });
  return status;
}

// --- S4 -----------------------------------------------------------------------------------------

/// Requires: S1 to S3.
absl::Status CheckNesting(const Surface& surface) {
  const std::vector<int> turns = OrientationsOf(surface);
  const std::vector<std::uint32_t> around = ShellsAround(surface);
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const std::uint32_t outer = surface.outer_of[shell];
    const bool is_cavity = outer != kNoShell;
    if (is_cavity && outer >= surface.ShellCount()) {
      return Broken("S4: cavity ", shell, " names shell ", outer, " of ", surface.ShellCount());
    }
    if (turns[shell] != (is_cavity ? -1 : 1)) {
      return Broken("S4: shell ", shell, is_cavity ? ", a cavity," : "", " is turned inside out");
    }
    const std::uint32_t found = around[shell];
    if (is_cavity ? found == outer && surface.outer_of[outer] == kNoShell
                  : found == kNoShell || surface.outer_of[found] != kNoShell) {
      continue;
    }
    return Broken("S4: shell ", shell, is_cavity ? ", a cavity," : "", " lies in shell ",
                  static_cast<std::int64_t>(found == kNoShell ? -1 : std::int64_t{found}),
                  " and names ", static_cast<std::int64_t>(is_cavity ? std::int64_t{outer} : -1));
  }
  return absl::OkStatus();
}

// --- S5: values ---------------------------------------------------------------------------------

absl::Status CheckNormals(const Surface& surface) {
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double component = surface.normals[3 * k + axis];
      square += component * component;
    }
    if (std::abs(square - 1) <= 1e-5) continue;
    return Broken("S5: the normal of point ", k, " has the squared length ",
                  ShortestNumber(square));
  }
  return absl::OkStatus();
}

absl::Status CheckCuts(const Surface& surface) {
  for (std::size_t k = 0; k < surface.cuts.size(); ++k) {
    const std::uint32_t t = surface.cuts[k];
    if (t >= surface.TriangleCount() || (k > 0 && t <= surface.cuts[k - 1])) {
      return Broken("S5: triangle ", t, " of the cuts is not in order, or beyond the ",
                    surface.TriangleCount(), " triangles");
    }
    const Triangle triangle = TriangleAt(surface, t);
    bool is_on_plane = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = [&](int corner) { return surface.points[3 * triangle[corner] + axis]; };
      is_on_plane = is_on_plane || (at(0) == at(1) && at(1) == at(2));
    }
    if (!is_on_plane)
      return Broken("S5: triangle ", t, " of the cuts is in no plane parallel to two axes");
  }
  return absl::OkStatus();
}

absl::Status CheckMeasures(const Surface& surface) {
  constexpr double kTolerance = 1e-6;
  std::size_t cut = 0;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const Vec3 origin = Vec3At(surface.points, surface.point_offsets[shell]);
    double area = 0, volume = 0, size = 0, cut_area = 0;
    Vec3 moment;
    for (std::size_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
         ++t) {
      const Triangle triangle = TriangleAt(surface, t);
      const Vec3 a = Vec3At(surface.points, triangle[0]) - origin;
      const Vec3 b = Vec3At(surface.points, triangle[1]) - origin;
      const Vec3 c = Vec3At(surface.points, triangle[2]) - origin;
      const double part = Dot(a, Cross(b, c)) / 6;
      const bool is_cut = cut < surface.cuts.size() && surface.cuts[cut] == t;
      (is_cut ? cut_area : area) += Length(Cross(b - a, c - a)) / 2;
      cut += is_cut ? 1 : 0;
      volume += part;
      moment = moment + (part / 4) * (a + b + c);
      size = std::max({size, Length(a), Length(b), Length(c)});
    }
    const ShellMeasures& said = surface.measures[shell];
    if (!(std::abs(said.area - area) <= kTolerance * area)) {
      return Broken("S5: shell ", shell, " has area ", ShortestNumber(area), ", not ",
                    ShortestNumber(said.area));
    }
    const double bound = kTolerance * (std::abs(volume) + kTolerance * (area + cut_area) * size);
    if (!(std::abs(said.volume - volume) <= bound)) {
      return Broken("S5: shell ", shell, " has volume ", ShortestNumber(volume), ", not ",
                    ShortestNumber(said.volume));
    }
    const Vec3 centroid{said.centroid_x, said.centroid_y, said.centroid_z};
    const Vec3 error = volume * (centroid - origin) - moment;
    // The squares of these products would overflow for large spacings. std::max may skip a NaN.
    const double most = std::max({std::abs(error.x), std::abs(error.y), std::abs(error.z)});
    if (!(error == Vec3{} || most * Length((1 / most) * error) <= bound * size))
      return Broken("S5: shell ", shell, " has another centroid");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const Surface& surface) {
  for (const auto check : {CheckSizes, CheckCoordinates, CheckIndices}) {
    if (absl::Status status = check(surface); !status.ok()) return status;
  }
  std::vector<Side> sides;
  if (absl::Status status = LinkSides(surface, sides); !status.ok()) return status;
  for (const auto check : {CheckLinks, CheckConnected}) {
    if (absl::Status status = check(surface, sides); !status.ok()) return status;
  }
  for (const auto check : {CheckCollisions, CheckNesting, CheckNormals, CheckCuts, CheckMeasures}) {
    if (absl::Status status = check(surface); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
