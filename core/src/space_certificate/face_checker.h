// The faces between cells, and the modes of the certificate that are valid for them
// (certificate.h).
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"
#include "space_certificate/certificate.h"
#include "space_certificate/moved_nodes.h"

namespace partiemc::space {

/// A cell beside a face.
struct Side {
  std::array<int, 3> at{};          ///< Relative to the brick of the face.
  std::uint32_t active = kNoIndex;  ///< Index among the active cells; kNoIndex if not active.
  /// The vertex of a cell with one loop; if the cell has no vertex, the mean of its corners.
  Vec3 apex;
};

/// A face between two cells. Its crossed sides are split at their vertices.
struct Face {
  int axis = 0;
  Side low, high;
  /// Corners and vertices on crossed sides, counter-clockwise as seen from the high side.
  std::array<Vec3, 8> around;
  /// For each point of `around`: its vertex, or the vertex count plus its index in MovedNodes;
  /// kNoIndex for a node that stays.
  std::array<std::uint32_t, 8> item;
  std::array<bool, 8> is_vertex;
  int count = 0;    ///< Of points of `around`.
  int crossed = 0;  ///< Number of crossed sides: 0, 2 or 4.
};

/// Checks the faces of the cells of a brick. Caches the nodes and cells that it has read, so no
/// vertex or node may move while it exists. Keeps references to its arguments. About 75 kB.
class FaceChecker {
 public:
  FaceChecker(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
              const std::vector<Vec3>& positions, const MovedNodes& nodes, std::uint32_t brick)
      : bricks_(bricks),
        crossings_(crossings),
        cell_size_(cell_size),
        positions_(positions),
        nodes_(nodes),
        brick_(brick),
        centre_(cell_size * (OriginOf(bricks[brick]) + Vec3{kHalf, kHalf, kHalf})),
        bound_(BoundOf(cell_size)) {}

  /// Makes FindMode take every sign from exact predicates.
  void UseExactSigns() { bound_ = std::numeric_limits<double>::infinity(); }

  /// The face with the number `face` (cell_loops.h) of a cell. `cell`: relative to the brick.
  Face FaceOf(const std::array<int, 3>& cell, int face);

  /// Returns true for most valid faces without crossings, and false for all other faces. Cheaper
  /// than FaceOf and FindMode.
  bool IsPlainlyValid(const std::array<int, 3>& cell, int face);

  /// Returns whether the face has a valid mode, and sets `mode` to it. If the face has no crossings
  /// or no valid mode, or a cell beside it has several loops, `mode` is kAlongFace.
  bool FindMode(const Face& face, QuadMode& mode) const;

  /// Calls visit(item) for each vertex and each node that may move, of the bipyramid over the face.
  /// Items are as in Face::item. An item may be visited twice.
  template <typename Visit>
  void ForEachItem(const Face& face, Visit visit) {
    for (int k = 0; k < face.count; ++k) {
      if (face.item[k] != kNoIndex) visit(face.item[k]);
    }
    for (const Side& side : {face.low, face.high}) {
      if (side.active == kNoIndex) {
        for (int corner = 0; corner < 8; ++corner) {
          const std::uint32_t item = CornerOf(side.at, corner).item;
          if (item != kNoIndex) visit(item);
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
  /// The moved position of a node, and its item as in Face. Not initialised: there are many.
  struct Node {
    double x, y, z;
    std::uint32_t item;

    Vec3 At() const { return {x, y, z}; }
  };
  /// The apex of a cell, and its index as in Side.
  struct Cell {
    double x, y, z;
    std::uint32_t active;
  };
  static constexpr double kHalf = .5 * kBrickSize;
  /// Points are near up to this distance from the centre of the brick, in cells along each axis.
  static constexpr double kNear = 16;

  /// The largest error of the determinant of three differences of near points, and a margin. Each
  /// of its six products has eight roundings: 6 (2 kNear)^3 8 eps with eps = 2^-53.
  static double BoundOf(double cell_size) {
    const double longest = 2 * kNear * cell_size;
    return 0x1p-53 * 100 * (longest * longest * longest);
  }
  /// Makes all later predicates exact if the point is not near, because `bound_` does not hold.
  void Include(const Vec3& point) {
    const Vec3 from = point - centre_;
    const double farthest = std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)});
    if (!(farthest <= kNear * cell_size_)) bound_ = std::numeric_limits<double>::infinity();
  }

  static constexpr int kNodesAlong = kBrickSize + 3;  ///< From -1 on.
  static constexpr int kCellsAlong = kBrickSize + 2;  ///< From -1 on.

  static std::size_t IndexOf(const std::array<int, 3>& at, int along) {
    return static_cast<std::size_t>(((at[2] + 1) * along + at[1] + 1) * along + at[0] + 1);
  }
  const Node& CornerOf(const std::array<int, 3>& cell, int corner) {
    const std::array<int, 3> at{cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1),
                                cell[2] + (corner >> 2)};
    const std::size_t index = IndexOf(at, kNodesAlong);
    if (!has_node_[index]) FindNode(at, index);
    return node_[index];
  }
  const Cell& CellAt(const std::array<int, 3>& at) {
    const std::size_t index = IndexOf(at, kCellsAlong);
    if (!has_cell_[index]) FindCell(at, index);
    return cell_[index];
  }
  Side SideAt(const std::array<int, 3>& at) {
    const Cell& cell = CellAt(at);
    return {at, cell.active, {cell.x, cell.y, cell.z}};
  }
  void FindNode(const std::array<int, 3>& at, std::size_t index);
  void FindCell(const std::array<int, 3>& at, std::size_t index);
  bool IsValidAcross(const Face& face, const Vec3& below, const Vec3& above) const;
  bool IsValidAlong(const Face& face, const Vec3& below, const Vec3& above) const;
  bool CanTriangulate(const Face& face, std::span<const std::uint8_t> polygon, const Vec3& below,
                      const Vec3& above) const;

  const BrickDirectory& bricks_;
  const SpaceCrossings& crossings_;
  const double cell_size_;
  const std::vector<Vec3>& positions_;
  const MovedNodes& nodes_;
  const std::uint32_t brick_;
  const Vec3 centre_;
  double bound_;  // Largest error of determinants; infinite: exact predicates only.
  std::bitset<kNodesAlong * kNodesAlong * kNodesAlong> has_node_;
  std::bitset<kCellsAlong * kCellsAlong * kCellsAlong> has_cell_;
  std::array<Node, kNodesAlong * kNodesAlong * kNodesAlong> node_;
  std::array<Cell, kCellsAlong * kCellsAlong * kCellsAlong> cell_;
};

}  // namespace partiemc::space
