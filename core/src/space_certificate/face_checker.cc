#include "space_certificate/face_checker.h"

#include <algorithm>
#include <cstddef>

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

/// All triangulations of a polygon with 3 to 6 corners.
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

void FaceChecker::FindNode(const std::array<int, 3>& at, std::size_t index) {
  has_node_[index] = true;
  const Vec3 origin = OriginOf(bricks_[brick_]);
  Vec3 position{cell_size_ * (origin.x + at[0]), cell_size_ * (origin.y + at[1]),
                cell_size_ * (origin.z + at[2])};
  const std::uint32_t moved = nodes_.IndexOf(Normalise(bricks_, brick_, at[0], at[1], at[2]));
  if (moved != kNoIndex) position = position + nodes_.moves[moved];
  Include(position);
  node_[index] = {position.x, position.y, position.z,
                  moved == kNoIndex ? kNoIndex : crossings_.VertexCount() + moved};
}

void FaceChecker::FindCell(const std::array<int, 3>& at, std::size_t index) {
  has_cell_[index] = true;
  const BrickPlace place = Normalise(bricks_, brick_, at[0], at[1], at[2]);
  const bool is_active = place.brick != kNoIndex &&
                         (crossings_.bricks[place.brick].active[place.k] >> place.Bit() & 1) != 0;
  Vec3 apex;
  Cell& cell = cell_[index];
  cell.active = is_active ? crossings_.CellAt(place) : kNoIndex;
  if (is_active) {
    apex = positions_[crossings_.cells[cell.active].first_loop];
  } else {
    for (int corner = 0; corner < 8; ++corner) apex = apex + CornerOf(at, corner).At();
    apex = .125 * apex;
  }
  Include(apex);
  cell.x = apex.x, cell.y = apex.y, cell.z = apex.z;
}

bool FaceChecker::IsPlainlyValid(const std::array<int, 3>& cell, int face) {
  const int axis = face / 2;
  std::array<int, 3> low = cell, high = cell;
  if ((face & 1) != 0) {
    ++high[axis];
  } else {
    --low[axis];
  }
  const Cell &of_low = CellAt(low), &of_high = CellAt(high);
  const std::array<int, 4> corners = CornersOfFace(2 * axis + 1);
  if (of_low.active != kNoIndex) {
    const ActiveCell& active = crossings_.cells[of_low.active];
    if (LoopsOf(active.corners).loops > 1) return false;
    if (of_high.active != kNoIndex) {
      if (LoopsOf(crossings_.cells[of_high.active].corners).loops > 1) return false;
      const unsigned all =
          1u << corners[0] | 1u << corners[1] | 1u << corners[2] | 1u << corners[3];
      const unsigned inside = active.corners & all;
      if (inside != 0 && inside != all) return false;
    }
  } else if (of_high.active != kNoIndex &&
             LoopsOf(crossings_.cells[of_high.active].corners).loops > 1) {
    return false;
  }
  const Vec3 below{of_low.x, of_low.y, of_low.z}, above{of_high.x, of_high.y, of_high.z};
  std::array<Vec3, 4> at;
  for (int k = 0; k < 4; ++k) at[k] = CornerOf(low, corners[k]).At();
  const auto is_between = [&](int a, int b, int c) {
    const Vec3 normal = Cross(at[b] - at[a], at[c] - at[a]);
    return Dot(normal, above - at[a]) > bound_ && Dot(normal, below - at[a]) < -bound_;
  };
  return (is_between(0, 1, 2) && is_between(0, 2, 3)) ||
         (is_between(1, 2, 3) && is_between(0, 1, 3));
}

Face FaceChecker::FaceOf(const std::array<int, 3>& cell, int face) {
  Face of;
  of.axis = face / 2;
  std::array<int, 3> beside = cell;
  beside[of.axis] += (face & 1) != 0 ? 1 : -1;
  of.low = SideAt((face & 1) != 0 ? cell : beside);
  of.high = SideAt((face & 1) != 0 ? beside : cell);
  // Counter-clockwise as seen from the high side: the corners of the upper face of the low cell.
  const std::array<int, 4> corners = CornersOfFace(2 * of.axis + 1);
  const bool has_crossings = of.low.active != kNoIndex && of.high.active != kNoIndex;
  for (int k = 0; k < 4; ++k) {
    const int a = corners[k], b = corners[(k + 1) & 3];
    const Node& node = CornerOf(of.low.at, a);
    of.around[of.count] = node.At();
    of.is_vertex[of.count] = false;
    of.item[of.count++] = node.item;
    if (!has_crossings) continue;
    const ActiveCell& low = crossings_.cells[of.low.active];
    if (((low.corners >> a ^ low.corners >> b) & 1) == 0) continue;
    const std::uint32_t v = EdgeVertexOf(bricks_, crossings_, low, EdgeBetween(a, b));
    of.around[of.count] = positions_[v];
    Include(positions_[v]);
    of.is_vertex[of.count] = true;
    of.item[of.count++] = v;
    ++of.crossed;
  }
  return of;
}

bool FaceChecker::IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const {
  const Vec3 axis = above - below;
  Vec3 from = face.around[0] - above;
  for (int k = 0; k < face.count; ++k) {
    const Vec3& next = face.around[k + 1 < face.count ? k + 1 : 0];
    const Vec3 to = next - above;
    const double determinant = Dot(Cross(to, axis), from);
    from = to;
    if (determinant > bound_) continue;
    if (SideOfPlane(face.around[k], next, below, above) <= 0) return false;
  }
  return true;
}

/// Whether a triangulation of a part of the face has positive tetrahedra with both apexes.
/// `polygon`: indices of `face.around`.
bool FaceChecker::CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon,
                                 const Vec3& below, const Vec3& above) const {
  for (const auto& triangulation : TriangulationsOf(static_cast<int>(polygon.size()))) {
    const bool is_valid = std::all_of(
        triangulation.begin(), triangulation.end(), [&](const std::array<std::uint8_t, 3>& t) {
          const Vec3 &a = face.around[polygon[t[0]]], &b = face.around[polygon[t[1]]],
                     &c = face.around[polygon[t[2]]];
          const Vec3 normal = Cross(b - a, c - a);
          return (Dot(normal, above - a) > bound_ || SideOfPlane(a, b, c, above) > 0) &&
                 (Dot(normal, below - a) < -bound_ || SideOfPlane(a, b, c, below) < 0);
        });
    if (is_valid) return true;
  }
  return false;
}

/// Whether kAlongFace is valid. The curves cut the face into parts, which are independent.
bool FaceChecker::IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const {
  if (face.crossed == 0) {
    return CanTriangulate(face, std::array<std::uint8_t, 4>{0, 1, 2, 3}, below, above);
  }
  std::array<std::uint8_t, 8> part;
  const auto check = [&](int first, int last) {  // The part from a vertex to the next one.
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
  const Vec3 &below = face.low.apex, &above = face.high.apex;
  // A face of a cell with several loops is flat. The apex of the other cell must be on its own side
  // of the face.
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
