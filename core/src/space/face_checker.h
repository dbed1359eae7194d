// The faces between cells, and the modes of the certificate that are valid for them
// (certificate.h).
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/certificate.h"
#include "space/crossings.h"
#include "space/lattice.h"
#include "space/moved_nodes.h"

namespace partiemc::space {

/// A cell beside a face.
struct Side {
  std::array<int, 3> at{};          ///< Relative to the brick of the face.
  std::uint32_t active = kNoIndex;  ///< Index among the active cells; kNoIndex if not active.
  /// The vertex of a cell with one loop; if the cell has no vertex, the mean of its corners.
  Vec3 apex;
};

/// A face between two cells, with its split sides.
struct Face {
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

/// Checks the faces of the cells of a brick. Finds nodes and cells when a face first needs them,
/// and keeps them for its other faces: while it exists, nothing may move. Refers to its arguments;
/// about 90 kB.
class FaceChecker {
 public:
  FaceChecker(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
              const std::vector<Vec3>& positions, const MovedNodes& nodes, std::uint32_t brick)
      : bricks_(bricks),
        crossings_(crossings),
        cell_size_(cell_size),
        positions_(positions),
        nodes_(nodes),
        brick_(brick) {}

  /// A face of the cell (i, j, k).
  Face FaceOf(const std::array<int, 3>& cell, int face);

  /// Returns whether any mode is valid, and sets `mode`.
  bool FindMode(const Face& face, QuadMode& mode) const;

  /// Calls visit(item) for the vertices and nodes of a face that may move.
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
  /// A node, moved, and its item as in Face. Not initialised, because bricks have many.
  struct Node {
    double x, y, z;
    std::uint32_t item;

    Vec3 At() const { return {x, y, z}; }
  };
  /// A cell: as Side.
  struct Cell {
    double x, y, z;
    std::uint32_t active;
  };
  static constexpr int kNodesAlong = kBrickSize + 3;  ///< From -1 on.
  static constexpr int kCellsAlong = kBrickSize + 2;  ///< From -1 on.

  const Node& CornerOf(const std::array<int, 3>& cell, int corner);
  Side SideAt(const std::array<int, 3>& cell);
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
  std::bitset<kNodesAlong * kNodesAlong * kNodesAlong> has_node_;
  std::bitset<kCellsAlong * kCellsAlong * kCellsAlong> has_cell_;
  std::array<Node, kNodesAlong * kNodesAlong * kNodesAlong> node_;
  std::array<Cell, kCellsAlong * kCellsAlong * kCellsAlong> cell_;
};

}  // namespace partiemc::space
