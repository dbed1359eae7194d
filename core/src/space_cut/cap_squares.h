// Squares in the interior of a cap, so that attributes have values there.
//
// A cap has points on its rim only, because its triangulation adds none. Squares of a lattice in
// the plane, away from the rim, give it inner points: the squares are halved, and only the part of
// the cap around them is triangulated.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "space_cut/cut_mesh.h"

namespace partiemc::space {

/// The squares of a cap. Keeps its memory.
class CapSquares {
 public:
  /// Finds the squares with sides `step` that lie inside a cap, at least step / 4 away from its
  /// edges. Squares that only touch each other at a corner are left out. There are none if
  /// coordinates are beyond 2^30 steps. Deterministic. Cost: n log n in edges and squares, and
  /// linear in the squares that the edges are near.
  void Find(const CutMesh& mesh, const CutMesh::Cap& cap, double step);

  bool empty() const { return squares_.empty(); }

  /// Appends the corners of the squares to the points of the mesh, and the edges around the squares
  /// to `edges`: the part of the cap without squares is on their left.
  void AddPoints(const CutMesh::Cap& cap, CutMesh& mesh, std::vector<CutMesh::CapEdge>& edges);

  /// Appends two triangles for each square. Requires: AddPoints.
  void AddTriangles(CutMesh& mesh) const;

 private:
  /// A node of the lattice, or the square above and right of it, in the axes of PlaneFrame.
  struct Place {
    std::int32_t row, column;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  struct Square {
    Place at;
    std::uint32_t shell;
  };
  /// An edge in one of the rows near it. Near: up to step / 4 away (kMargin). [first, last] are the
  /// columns near the whole edge, not only near its part in the row. If the edge crosses the middle
  /// of the row, `at` is the place in steps. `is_entry`: the cap is right of it.
  struct RowEdge {
    std::int32_t row, first, last;
    std::uint32_t shell;
    bool crosses, is_entry;
    double at;
  };

  void ListRows(const CutMesh& mesh, const CutMesh::Cap& cap);
  void FillRow(std::span<RowEdge> edges);
  bool Has(const Place& at) const;
  bool DropPinches();
  std::uint32_t PointAt(const Place& at) const;

  double step_ = 1;
  std::vector<RowEdge> rows_;
  std::vector<RowEdge> crossings_;     // Of one row.
  std::vector<Square> squares_;        // Sorted by place.
  std::vector<std::uint8_t> pinched_;  // By square.
  std::vector<Place> corners_;         // Sorted.
  std::uint32_t first_point_ = 0;      // The point of the first corner.
};

}  // namespace partiemc::space
