// The faces between cells, and the modes of the certificate that are valid for them
// (certificate.h).
#pragma once

#include <array>
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

/// Checks faces. Refers to its arguments.
class FaceChecker {
 public:
  FaceChecker(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
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

}  // namespace partiemc::space
