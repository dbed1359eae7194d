#include "space/face_checker.h"

#include <algorithm>

#include "base/predicates_in_space.h"

namespace partiemc::space {
namespace {

/// All triangulations of a polygon with n corners, three indices for each triangle.
using Triangulations = std::vector<std::vector<std::array<std::uint8_t, 3>>>;

Triangulations TriangulationsOf(int first, int last) {
  if (last - first < 2) return {{}};
  Triangulations all;
  for (int middle = first + 1; middle < last; ++middle) {
    for (const auto& left : TriangulationsOf(first, middle)) {
      for (const auto& right : TriangulationsOf(middle, last)) {
        auto& triangulation = all.emplace_back(left);
        triangulation.insert(triangulation.end(), right.begin(), right.end());
        triangulation.push_back({static_cast<std::uint8_t>(first),
                                 static_cast<std::uint8_t>(middle),
                                 static_cast<std::uint8_t>(last)});
      }
    }
  }
  return all;
}

/// All triangulations of a polygon with 3 to 6 corners. The part between the curves of an ambiguous
/// face has six.
const Triangulations& TriangulationsOf(int corners) {
  static const std::array<Triangulations, 7> all = [] {
    std::array<Triangulations, 7> table;
    for (int n = 3; n < 7; ++n) table[n] = TriangulationsOf(0, n - 1);
    return table;
  }();
  return all[corners];
}

double Along(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

Face FaceChecker::FaceOf(std::uint32_t brick, const std::array<int, 3>& cell, int face) const {
  Face of;
  of.brick = brick;
  of.axis = face / 2;
  of.low.at = of.high.at = cell;
  ((face & 1) != 0 ? of.high : of.low).at[of.axis] += (face & 1) != 0 ? 1 : -1;
  for (Side* side : {&of.low, &of.high}) {
    const BrickPlace place = Normalise(bricks_, brick, side->at[0], side->at[1], side->at[2]);
    const bool is_active = place.brick != kNoIndex &&
                           (crossings_.bricks[place.brick].active[place.k] >> place.Bit() & 1) != 0;
    if (is_active) side->active = crossings_.CellAt(place);
  }
  // The corners as seen from above: they are the corners of the upper face of the cell below.
  const std::array<int, 4> corners = CornersOfFace(2 * of.axis + 1);
  const bool has_crossings = of.low.active != kNoIndex && of.high.active != kNoIndex;
  for (int k = 0; k < 4; ++k) {
    const int a = corners[k], b = corners[(k + 1) & 3];
    const std::uint32_t node = nodes_.IndexOf(NodeOf(brick, of.low.at, a));
    of.around[of.count] = NodeAt(brick, of.low.at, a);
    of.is_vertex[of.count] = false;
    of.item[of.count++] = node == kNoIndex ? kNoIndex : crossings_.VertexCount() + node;
    if (!has_crossings) continue;
    const ActiveCell& low = crossings_.cells[of.low.active];
    if (((low.corners >> a ^ low.corners >> b) & 1) == 0) continue;
    const std::uint32_t v = EdgeVertexOf(bricks_, crossings_, low, EdgeBetween(a, b));
    of.around[of.count] = positions_[v];
    of.is_vertex[of.count] = true;
    of.item[of.count++] = v;
    ++of.crossed;
  }
  return of;
}

Vec3 FaceChecker::ApexOf(std::uint32_t brick, const Side& side) const {
  if (side.active != kNoIndex) return positions_[crossings_.cells[side.active].first_loop];
  Vec3 sum;
  for (int corner = 0; corner < 8; ++corner) sum = sum + NodeAt(brick, side.at, corner);
  return .125 * sum;
}

bool FaceChecker::IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const {
  for (int k = 0; k < face.count; ++k) {
    const Vec3& next = face.around[k + 1 < face.count ? k + 1 : 0];
    if (SideOfPlane(face.around[k], next, below, above) <= 0) return false;
  }
  return true;
}

/// Whether a triangulation of a part of the face has positive tetrahedra on both sides.
bool FaceChecker::CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon,
                                 const Vec3& below, const Vec3& above) const {
  for (const auto& triangulation : TriangulationsOf(static_cast<int>(polygon.size()))) {
    const bool is_valid = std::all_of(
        triangulation.begin(), triangulation.end(), [&](const std::array<std::uint8_t, 3>& t) {
          const Vec3 &a = face.around[polygon[t[0]]], &b = face.around[polygon[t[1]]],
                     &c = face.around[polygon[t[2]]];
          return SideOfPlane(a, b, c, above) > 0 && SideOfPlane(a, b, c, below) < 0;
        });
    if (is_valid) return true;
  }
  return false;
}

/// Whether kAlongFace is valid. The curves cut the face into parts; each part is triangulated
/// alone.
bool FaceChecker::IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const {
  if (face.crossed == 0) {
    return CanTriangulate(face, std::array<std::uint8_t, 4>{0, 1, 2, 3}, below, above);
  }
  std::array<std::uint8_t, 8> part;
  const auto check = [&](int first, int last) {  // The part from one vertex to the next.
    int size = 0;
    for (int k = first;; k = k + 1 < face.count ? k + 1 : 0) {
      part[size++] = static_cast<std::uint8_t>(k);
      if (k == last) break;
    }
    return CanTriangulate(face, std::span(part).first(size), below, above);
  };
  std::array<int, 4> vertices{};
  int count = 0;
  for (int k = 0; k < face.count; ++k) {
    if (face.is_vertex[k]) vertices[count++] = k;
  }
  if (count == 2) return check(vertices[0], vertices[1]) && check(vertices[1], vertices[0]);
  // The face is ambiguous: its vertices are at 1, 3, 5, 7. The curves cut off the two inside
  // corners, which are opposite.
  const int first = CornersOfFace(2 * face.axis + 1)[0];
  const bool is_inside = (crossings_.cells[face.low.active].corners >> first & 1) != 0;
  // The part between the curves has the four vertices and the two other corners.
  constexpr std::array<std::uint8_t, 6> kEven{0, 1, 3, 4, 5, 7}, kOdd{1, 2, 3, 5, 6, 7};
  return is_inside ? check(7, 1) && check(3, 5) && CanTriangulate(face, kOdd, below, above)
                   : check(1, 3) && check(5, 7) && CanTriangulate(face, kEven, below, above);
}

bool FaceChecker::FindMode(const Face& face, QuadMode& mode) const {
  mode = QuadMode::kAlongFace;
  const bool is_low_fixed = IsFixed(face.low), is_high_fixed = IsFixed(face.high);
  if (is_low_fixed && is_high_fixed) return true;
  const Vec3 below = is_low_fixed ? Vec3{} : ApexOf(face.brick, face.low);
  const Vec3 above = is_high_fixed ? Vec3{} : ApexOf(face.brick, face.high);
  // A face of a fixed cell is flat. The vertex of the other cell must be on its own side of the
  // face.
  const double level = Along(face.around[0], face.axis);
  if (is_low_fixed) return Along(above, face.axis) > level;
  if (is_high_fixed) return Along(below, face.axis) < level;
  if (face.crossed == 0) {
    return IsValidAlong(face, below, above) || IsValidAcross(face, below, above);
  }
  if (face.crossed == 2 && IsValidAcross(face, below, above)) {
    mode = QuadMode::kAcrossCells;
    return true;
  }
  return IsValidAlong(face, below, above);
}

}  // namespace partiemc::space
