#include "space/certificate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <span>

#include "base/parallel.h"
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

/// A cell beside a face.
struct Side {
  std::array<int, 3> at{};          ///< Relative to the brick of the face.
  std::uint32_t active = kNoIndex;  ///< Index among the active cells; kNoIndex if not active.
};

/// A face between two cells, with its split sides.
struct Face {
  std::uint32_t brick = 0;
  int axis = 0;
  Side low, high;
  /// Corners and vertices on crossed sides, counter-clockwise as seen from above.
  std::array<Vec3, 8> around;
  /// For each point of `around`: its vertex, or the vertex count plus its moved node; kNoIndex for
  /// a node that does not move.
  std::array<std::uint32_t, 8> item;
  std::array<bool, 8> is_vertex;
  int count = 0;
  int crossed = 0;
};

class Checker {
 public:
  Checker(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
          const std::vector<Vec3>& positions, const MovedNodes& nodes)
      : bricks_(bricks),
        crossings_(crossings),
        cell_size_(cell_size),
        positions_(positions),
        nodes_(nodes) {}

  /// A face of the cell (i, j, k) of a brick.
  Face FaceOf(std::uint32_t brick, const std::array<int, 3>& cell, int face) const;

  /// Returns whether any mode is valid, and sets `mode`.
  bool FindMode(const Face& face, QuadMode& mode) const;

  /// Calls visit(item) for the vertices and nodes of a face that may move.
  template <typename Visit>
  void ForEachItem(const Face& face, Visit visit) const {
    for (int k = 0; k < face.count; ++k) {
      if (face.item[k] != kNoIndex) visit(face.item[k]);
    }
    for (const Side& side : {face.low, face.high}) {
      if (side.active == kNoIndex) {
        for (int corner = 0; corner < 8; ++corner) {
          const std::uint32_t node = nodes_.IndexOf(NodeOf(face.brick, side.at, corner));
          if (node != kNoIndex) visit(crossings_.VertexCount() + node);
        }
      } else if (!IsFixed(side)) {
        visit(crossings_.cells[side.active].first_loop);
      }
    }
  }

 private:
  bool IsFixed(const Side& side) const {
    return side.active != kNoIndex && LoopsOf(crossings_.cells[side.active].corners).loops > 1;
  }
  BrickPlace NodeOf(std::uint32_t brick, const std::array<int, 3>& cell, int corner) const {
    return Normalise(bricks_, brick, cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1),
                     cell[2] + (corner >> 2));
  }
  Vec3 NodeAt(std::uint32_t brick, const std::array<int, 3>& cell, int corner) const {
    return space::NodeAt(
        bricks_, nodes_, cell_size_, brick,
        {cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)});
  }
  /// The vertex of a cell with one loop; if the cell has no vertex, the mean of its corners.
  Vec3 ApexOf(std::uint32_t brick, const Side& side) const;
  bool IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const;
  bool IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const;
  bool CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon, const Vec3& below,
                      const Vec3& above) const;

  const BrickDirectory& bricks_;
  const SpaceCrossings& crossings_;
  const double cell_size_;
  const std::vector<Vec3>& positions_;
  const MovedNodes& nodes_;
};

double Along(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Face Checker::FaceOf(std::uint32_t brick, const std::array<int, 3>& cell, int face) const {
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

Vec3 Checker::ApexOf(std::uint32_t brick, const Side& side) const {
  if (side.active != kNoIndex) return positions_[crossings_.cells[side.active].first_loop];
  Vec3 sum;
  for (int corner = 0; corner < 8; ++corner) sum = sum + NodeAt(brick, side.at, corner);
  return .125 * sum;
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

/// Whether kAlongFace is valid. The curves cut the face into parts; each part is triangulated
/// alone.
bool Checker::IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const {
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

bool Checker::FindMode(const Face& face, QuadMode& mode) const {
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

/// Calls visit(cell, side) for each face of the near cells of a brick once.
template <typename Visit>
void ForEachFace(const BrickDirectory& bricks, const MovedNodes& nodes, std::uint32_t brick,
                 Visit visit) {
  for (int k = 0; k < kBrickSize; ++k) {
    for (std::uint64_t bits = nodes.bricks[brick].near[k]; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      const std::array<int, 3> cell{bit % kBrickSize, bit / kBrickSize, k};
      for (int side = 0; side < 6; ++side) {
        if ((side & 1) == 0) {
          // If the cell below is near, the face is visited as its upper face.
          std::array<int, 3> at = cell;
          --at[side / 2];
          const BrickPlace place = Normalise(bricks, brick, at[0], at[1], at[2]);
          if (place.brick != kNoIndex &&
              (nodes.bricks[place.brick].near[place.k] >> place.Bit() & 1) != 0) {
            continue;
          }
        }
        visit(cell, side);
      }
    }
  }
}

/// Whether something in a brick or around it has moved.
bool HasMovedAround(const BrickDirectory& bricks, std::uint32_t brick,
                    const std::vector<std::uint8_t>& has_moved) {
  if (has_moved[brick] != 0) return true;
  const BrickNeighbours& around = bricks.neighbours(brick);
  return std::any_of(around.begin(), around.end(), [&](std::uint32_t other) {
    return other != kNoIndex && has_moved[other] != 0;
  });
}

/// Moves the vertices and nodes of refused faces back. Returns whether any of them could move.
bool MoveBack(const BrickDirectory& bricks, const SpaceCrossings& crossings,
              const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
              Certificate& certificate) {
  std::atomic<std::uint32_t> returned = 0;
  std::atomic<bool> has_any = false;
  ParallelFor(static_cast<std::uint32_t>(crossings.bricks.size()), [&](std::uint32_t brick) {
    bool has_moved = false;
    const auto move_vertex = [&](std::uint32_t v, const Vec3& mean_move) {
      certificate.is_bad[v] = 0;
      if (positions[v] == anchors[v]) return;
      const int setbacks = ++certificate.setbacks[v];
      if (setbacks == 1) returned.fetch_add(1, std::memory_order_relaxed);
      if (setbacks <= kSmoothings) {
        positions[v] = anchors[v] + mean_move;
      } else if (setbacks < kMostSetbacks) {
        positions[v] = anchors[v] + kKeptOfMove * (positions[v] - anchors[v]);
      } else {
        positions[v] = anchors[v];
      }
      has_moved = true;
    };
    const auto move_at = [&](int i, int j, int k) {
      const std::uint32_t node = certificate.nodes.IndexOf(Normalise(bricks, brick, i, j, k));
      return node == kNoIndex ? Vec3{} : certificate.nodes.moves[node];
    };
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      if (certificate.is_bad[v] == 0) return;
      move_vertex(
          v, .5 * (move_at(i, j, k) + move_at(i + (axis == 0), j + (axis == 1), k + (axis == 2))));
    });
    const SpaceCrossings::Brick& at = crossings.bricks[brick];
    const std::uint32_t end = brick + 1 < crossings.bricks.size()
                                  ? crossings.bricks[brick + 1].first_cell
                                  : static_cast<std::uint32_t>(crossings.cells.size());
    for (std::uint32_t cell = at.first_cell; cell < end; ++cell) {
      const ActiveCell& of = crossings.cells[cell];
      if (certificate.is_bad[of.first_loop] == 0) continue;
      Vec3 sum;
      for (int corner = 0; corner < 8; ++corner) {
        sum = sum + move_at(of.i + (corner & 1), of.j + (corner >> 1 & 1), of.k + (corner >> 2));
      }
      move_vertex(of.first_loop, .125 * sum);
    }
    MovedNodes& nodes = certificate.nodes;
    ForEachMovedNode(nodes, brick, [&](std::uint32_t node, int, int, int) {
      std::uint8_t& is_bad = certificate.is_bad[positions.size() + node];
      if (is_bad != 0 && nodes.setbacks[node] < kMostSetbacks) {
        ++nodes.setbacks[node];
        has_moved = true;
      }
      is_bad = 0;
    });
    certificate.has_moved[brick] = has_moved;
    if (has_moved) has_any.store(true, std::memory_order_relaxed);
  });
  certificate.returned += returned;
  return has_any;
}

/// Certifies the bricks in which something has moved, and the bricks around these.
bool CertifyMoved(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate) {
  const auto count = static_cast<std::uint32_t>(bricks.size());
  MovedNodes& nodes = certificate.nodes;
  const Checker checker(bricks, crossings, cell_size, positions, nodes);
  for (;;) {
    ParallelFor(count, [&](std::uint32_t brick) {
      if (!HasMovedAround(bricks, brick, certificate.has_moved)) return;
      MoveNodesOf(brick, bricks, crossings, cell_size, anchors, positions, nodes);
    });
    std::atomic<bool> is_refused = false;
    ParallelFor(count, [&](std::uint32_t brick) {
      if (!HasMovedAround(bricks, brick, certificate.has_moved)) return;
      ForEachFace(bricks, nodes, brick, [&](const std::array<int, 3>& cell, int side) {
        const Face face = checker.FaceOf(brick, cell, side);
        QuadMode mode;
        const bool is_valid = checker.FindMode(face, mode);
        if (face.crossed > 0) certificate.modes[face.low.active][face.axis] = mode;
        if (is_valid) return;
        is_refused.store(true, std::memory_order_relaxed);
        checker.ForEachItem(face, [&](std::uint32_t item) {
          std::atomic_ref(certificate.is_bad[item]).store(1, std::memory_order_relaxed);
        });
      });
    });
    if (!is_refused) break;
    ++certificate.rounds;
    if (!MoveBack(bricks, crossings, anchors, positions, certificate)) return false;
  }
  certificate.certified = positions;
  return true;
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
  const auto count = static_cast<std::uint32_t>(bricks.size());
  MovedNodes& nodes = certificate.nodes;
  FindMovedNodes(bricks, crossings, nodes);
  certificate.modes.assign(crossings.cells.size(), {});
  certificate.rounds = certificate.returned = 0;
  certificate.setbacks.assign(positions.size(), 0);
  certificate.is_bad.assign(positions.size() + nodes.count, 0);
  certificate.has_moved.assign(count, 1);
  return CertifyMoved(bricks, crossings, cell_size, anchors, positions, certificate);
}

bool CertifyAgain(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate) {
  const std::vector<Vec3>& certified = certificate.certified;
  certificate.has_moved.assign(bricks.size(), 0);
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int, int, int, int) {
      if (positions[v] != certified[v]) certificate.has_moved[brick] = 1;
    });
  });
  for (const ActiveCell& cell : crossings.cells) {
    const std::uint32_t v = cell.first_loop;
    if (positions[v] != certified[v]) certificate.has_moved[cell.brick] = 1;
  }
  return CertifyMoved(bricks, crossings, cell_size, anchors, positions, certificate);
}

std::uint32_t CountRefusedFaces(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                double cell_size, const std::vector<Vec3>& positions,
                                const Certificate& certificate) {
  const Checker checker(bricks, crossings, cell_size, positions, certificate.nodes);
  std::uint32_t refused = 0;
  for (std::uint32_t brick = 0; brick < bricks.size(); ++brick) {
    ForEachFace(bricks, certificate.nodes, brick, [&](const std::array<int, 3>& cell, int side) {
      const Face face = checker.FaceOf(brick, cell, side);
      QuadMode mode;
      const bool is_valid = checker.FindMode(face, mode);
      const bool is_as_cut =
          face.crossed == 0 || certificate.modes[face.low.active][face.axis] == mode;
      refused += !is_valid || !is_as_cut;
    });
  }
  return refused;
}

}  // namespace partiemc::space
