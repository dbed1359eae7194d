#include "space/certificate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <span>

#include "base/parallel.h"
#include "base/predicates_in_space.h"

namespace partiemc::space {
namespace {

// Setbacks after which a vertex returns to its anchor.
constexpr int kMostSetbacks = 5;

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

/// By the number of corners, up to the six between the curves of an ambiguous face.
const Triangulations& TriangulationsOf(int corners) {
  static const std::array<Triangulations, 7> all = [] {
    std::array<Triangulations, 7> table;
    for (int n = 3; n < 7; ++n) table[n] = TriangulationsOf(0, n - 1);
    return table;
  }();
  return all[corners];
}

/// A face between two cells, or between an active and an inactive one, with its split sides.
struct Face {
  int axis = 0;
  std::uint32_t low = kNoIndex, high = kNoIndex;  ///< Active cells below and above, or kNoIndex.
  /// Corners and vertices on crossed sides, counter-clockwise as seen from above.
  std::array<Vec3, 8> around;
  std::array<std::uint32_t, 8> vertex;  ///< kNoIndex: a corner, which is fixed.
  int count = 0;
  int crossed = 0;
};

class Checker {
 public:
  Checker(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
          const std::vector<Vec3>& positions)
      : bricks_(bricks), crossings_(crossings), cell_size_(cell_size), positions_(positions) {}

  /// The face of an active cell.
  Face FaceOf(std::uint32_t index, int face) const;

  /// Whether a mode is valid; sets it.
  bool FindMode(const Face& face, QuadMode& mode) const;

  /// Calls visit(vertex) for the vertices of a face that may move: those on its sides, and those of
  /// its cells with one loop.
  template <typename Visit>
  void ForEachVertex(const Face& face, Visit visit) const {
    for (int k = 0; k < face.count; ++k) {
      if (face.vertex[k] != kNoIndex) visit(face.vertex[k]);
    }
    for (const std::uint32_t cell : {face.low, face.high}) {
      if (cell != kNoIndex && !IsFixed(cell)) visit(crossings_.cells[cell].first_loop);
    }
  }

 private:
  bool IsFixed(std::uint32_t cell) const {
    return LoopsOf(crossings_.cells[cell].corners).loops > 1;
  }
  Vec3 NodeAt(const ActiveCell& cell, int corner) const {
    const Vec3 origin = OriginOf(bricks_[cell.brick]);
    return {cell_size_ * (origin.x + (cell.i + (corner & 1))),
            cell_size_ * (origin.y + (cell.j + (corner >> 1 & 1))),
            cell_size_ * (origin.z + (cell.k + (corner >> 2)))};
  }
  /// The vertex of a cell with one loop; of an inactive cell its centre, seen from the other cell.
  Vec3 ApexOf(std::uint32_t cell, std::uint32_t other, int axis, int step) const;
  bool IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const;
  bool IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const;
  bool CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon, const Vec3& below,
                      const Vec3& above) const;

  const BrickDirectory& bricks_;
  const SpaceCrossings& crossings_;
  const double cell_size_;
  const std::vector<Vec3>& positions_;
};

double Along(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Face Checker::FaceOf(std::uint32_t index, int face) const {
  const ActiveCell& cell = crossings_.cells[index];
  Face of;
  of.axis = face / 2;
  std::array<int, 3> at{cell.i, cell.j, cell.k};
  at[of.axis] += (face & 1) != 0 ? 1 : -1;
  const BrickPlace place = Normalise(bricks_, cell.brick, at[0], at[1], at[2]);
  const bool is_active = place.brick != kNoIndex &&
                         (crossings_.bricks[place.brick].active[place.k] >> place.Bit() & 1) != 0;
  const std::uint32_t other = is_active ? crossings_.CellAt(place) : kNoIndex;
  of.low = (face & 1) != 0 ? index : other;
  of.high = (face & 1) != 0 ? other : index;
  // Seen from above: the order of the upper face, moved to this one.
  const std::array<int, 4> corners = CornersOfFace(2 * of.axis + 1);
  const auto corner_at = [&](int k) {
    return (face & 1) != 0 ? corners[k & 3] : corners[k & 3] ^ 1 << of.axis;
  };
  for (int k = 0; k < 4; ++k) {
    const int a = corner_at(k), b = corner_at(k + 1);
    of.around[of.count] = NodeAt(cell, a);
    of.vertex[of.count++] = kNoIndex;
    if (((cell.corners >> a ^ cell.corners >> b) & 1) == 0) continue;
    const std::uint32_t v = EdgeVertexOf(bricks_, crossings_, cell, EdgeBetween(a, b));
    of.around[of.count] = positions_[v];
    of.vertex[of.count++] = v;
    ++of.crossed;
  }
  return of;
}

Vec3 Checker::ApexOf(std::uint32_t cell, std::uint32_t other, int axis, int step) const {
  if (cell != kNoIndex) return positions_[crossings_.cells[cell].first_loop];
  const ActiveCell& at = crossings_.cells[other];
  const Vec3 origin = OriginOf(bricks_[at.brick]);
  const auto middle = [&](int of_axis, double low) {
    return cell_size_ * (low + (of_axis == axis ? step : 0) + .5);
  };
  return {middle(0, origin.x + at.i), middle(1, origin.y + at.j), middle(2, origin.z + at.k)};
}

bool Checker::IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const {
  for (int k = 0; k < face.count; ++k) {
    const Vec3& next = face.around[k + 1 < face.count ? k + 1 : 0];
    if (SideOfPlane(face.around[k], next, below, above) <= 0) return false;
  }
  return true;
}

/// Whether a triangulation of a part of the face has positive tetrahedra on both sides.
bool Checker::CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon,
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

/// The curves cut the face into parts, each of which is triangulated.
bool Checker::IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const {
  if (face.crossed == 0) {
    return CanTriangulate(face, std::array<std::uint8_t, 4>{0, 1, 2, 3}, below, above);
  }
  std::array<std::uint8_t, 8> part;
  const auto check = [&](int first, int last) {  // From one vertex to the next, around.
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
    if (face.vertex[k] != kNoIndex) vertices[count++] = k;
  }
  if (count == 2) return check(vertices[0], vertices[1]) && check(vertices[1], vertices[0]);
  // Ambiguous: vertices are at 1, 3, 5, 7. Each of two opposite corners, those inside, is cut off.
  const std::uint32_t known = face.low != kNoIndex ? face.low : face.high;
  const std::array<int, 4> corners = CornersOfFace(2 * face.axis + 1);
  const int first = face.low != kNoIndex ? corners[0] : corners[0] ^ 1 << face.axis;
  const bool is_inside = (crossings_.cells[known].corners >> first & 1) != 0;
  // Between the curves remain the four vertices and the two other corners.
  constexpr std::array<std::uint8_t, 6> kEven{0, 1, 3, 4, 5, 7}, kOdd{1, 2, 3, 5, 6, 7};
  return is_inside ? check(7, 1) && check(3, 5) && CanTriangulate(face, kOdd, below, above)
                   : check(1, 3) && check(5, 7) && CanTriangulate(face, kEven, below, above);
}

bool Checker::FindMode(const Face& face, QuadMode& mode) const {
  mode = QuadMode::kAlongFace;
  const bool is_low_fixed = face.low != kNoIndex && IsFixed(face.low);
  const bool is_high_fixed = face.high != kNoIndex && IsFixed(face.high);
  if (is_low_fixed && is_high_fixed) return true;
  // The face of a fixed cell is flat: the other vertex must be on its own side.
  const double level = Along(face.around[0], face.axis);
  if (is_low_fixed) return Along(ApexOf(face.high, face.low, face.axis, 1), face.axis) > level;
  if (is_high_fixed) return Along(ApexOf(face.low, face.high, face.axis, -1), face.axis) < level;
  const Vec3 below = ApexOf(face.low, face.high, face.axis, -1);
  const Vec3 above = ApexOf(face.high, face.low, face.axis, 1);
  if (face.crossed == 0) {
    return (Along(below, face.axis) < level && Along(above, face.axis) > level) ||
           IsValidAcross(face, below, above);
  }
  if (face.crossed == 2 && IsValidAcross(face, below, above)) {
    mode = QuadMode::kAcrossCells;
    return true;
  }
  return IsValidAlong(face, below, above);
}

/// Calls visit(cell, face) for each face of an active cell once.
template <typename Visit>
void ForEachFace(const BrickDirectory& bricks, const SpaceCrossings& crossings, std::uint32_t index,
                 Visit visit) {
  const ActiveCell& cell = crossings.cells[index];
  for (int face = 0; face < 6; ++face) {
    if ((face & 1) == 0) {
      // The cell below has this face, if it is active.
      std::array<int, 3> at{cell.i, cell.j, cell.k};
      --at[face / 2];
      const BrickPlace place = Normalise(bricks, cell.brick, at[0], at[1], at[2]);
      if (place.brick != kNoIndex &&
          (crossings.bricks[place.brick].active[place.k] >> place.Bit() & 1) != 0) {
        continue;
      }
    }
    visit(face);
  }
}

/// Moves the vertices of refused faces back. Returns their number.
std::uint32_t MoveBack(const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                       Certificate& certificate) {
  std::uint32_t moved = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    certificate.is_checked[v] = 0;
    if (certificate.is_bad[v] == 0) continue;
    certificate.is_bad[v] = 0;
    if (positions[v] == anchors[v]) continue;
    const int setbacks = ++certificate.setbacks[v];
    certificate.returned += setbacks == 1;
    positions[v] = setbacks < kMostSetbacks ? .5 * (positions[v] + anchors[v]) : anchors[v];
    certificate.is_checked[v] = 1;
    ++moved;
  }
  return moved;
}

}  // namespace

void MarkFixedVertices(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                       std::vector<std::uint8_t>& is_fixed) {
  is_fixed.assign(crossings.VertexCount(), 0);
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    if (loops.loops < 2) continue;
    for (int loop = 0; loop < loops.loops; ++loop) is_fixed[cell.first_loop + loop] = 1;
    for (int step = 0; step < loops.Steps(); ++step) {
      is_fixed[EdgeVertexOf(bricks, crossings, cell, loops.edge[step])] = 1;
    }
  }
}

bool Certify(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
             const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
             Certificate& certificate) {
  const auto cells = static_cast<std::uint32_t>(crossings.cells.size());
  certificate.modes.assign(cells, {});
  certificate.rounds = certificate.returned = 0;
  certificate.setbacks.assign(positions.size(), 0);
  certificate.is_checked.assign(positions.size(), 1);
  certificate.is_bad.assign(positions.size(), 0);
  const Checker checker(bricks, crossings, cell_size, positions);
  for (;;) {
    std::atomic<bool> is_refused = false;
    ParallelFor(cells, [&](std::uint32_t index) {
      ForEachFace(bricks, crossings, index, [&](int side) {
        const Face face = checker.FaceOf(index, side);
        bool is_checked = false;
        checker.ForEachVertex(
            face, [&](std::uint32_t v) { is_checked |= certificate.is_checked[v] != 0; });
        if (!is_checked) return;
        QuadMode mode;
        const bool is_valid = checker.FindMode(face, mode);
        if ((side & 1) != 0) certificate.modes[index][side / 2] = mode;
        if (is_valid) return;
        is_refused.store(true, std::memory_order_relaxed);
        checker.ForEachVertex(face, [&](std::uint32_t v) {
          std::atomic_ref(certificate.is_bad[v]).store(1, std::memory_order_relaxed);
        });
      });
    });
    if (!is_refused) return true;
    ++certificate.rounds;
    if (MoveBack(anchors, positions, certificate) == 0) return false;
  }
}

void EmitQuads(const BrickDirectory& bricks, const SpaceCrossings& crossings,
               const Certificate& certificate, std::vector<VertexTriangle>& triangles) {
  triangles.clear();
  for (std::uint32_t index = 0; index < crossings.cells.size(); ++index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      if ((face & 1) == 0) continue;
      const int to_edge = loops.edge[loops.Next(step)];
      const ActiveCell& other = crossings.cells[CellAcross(bricks, crossings, cell, face)];
      const CellLoops& across = LoopsOf(other.corners);
      // The curve runs the other way there.
      int reversed = 0;
      while (across.edge[reversed] != EdgeAcross(to_edge, face) ||
             across.face[reversed] != (face ^ 1)) {
        ++reversed;
      }
      const std::uint32_t from = EdgeVertexOf(bricks, crossings, cell, loops.edge[step]);
      const std::uint32_t to = EdgeVertexOf(bricks, crossings, cell, to_edge);
      const std::uint32_t low = cell.first_loop + loops.loop_of[step];
      const std::uint32_t high = other.first_loop + across.loop_of[reversed];
      if (certificate.modes[index][face / 2] == QuadMode::kAlongFace) {
        triangles.push_back({low, from, to});
        triangles.push_back({high, to, from});
      } else {
        triangles.push_back({low, from, high});
        triangles.push_back({low, high, to});
      }
    }
  }
}

}  // namespace partiemc::space
