// Stage 3: finds the crossed edges, the active cells (with crossed edges) and their loops.
//
// Each crossed edge has a vertex. These vertices are numbered by brick, axis, layer, row, column.
// After them come the vertices in cells, one for each loop, by cell and loop.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "space/cell_loops.h"
#include "space/field.h"
#include "space/lattice.h"

namespace partiemc::space {

struct ActiveCell {
  std::uint32_t brick = 0;
  std::uint8_t i = 0, j = 0, k = 0;
  std::uint8_t corners = 0;      ///< Bit c is set if corner c is inside.
  std::uint32_t first_loop = 0;  ///< The vertex of its first loop.
};

struct SpaceCrossings {
  /// Crossed edges of a brick, by axis and layer, as bits at their lower nodes; active cells. Then
  /// the first vertex on an edge and the first active cell of the brick. Also the numbers of its
  /// crossed edges before an axis and layer, and of its active cells before a layer.
  struct Brick {
    std::array<BrickBits, 3> crossed{};
    BrickBits active{};
    std::uint32_t first_edge = 0, first_cell = 0;
    std::array<std::array<std::uint16_t, kBrickSize>, 3> edges_before{};
    std::array<std::uint16_t, kBrickSize> cells_before{};
  };
  std::vector<Brick> bricks;
  std::vector<ActiveCell> cells;
  std::uint32_t edge_count = 0, loop_count = 0;

  // After ListSteps:
  std::vector<std::uint32_t> first_step;  ///< By loop: its first step; then the number of steps.
  std::vector<std::uint32_t> step_edges;  ///< By step: the vertex on its crossed edge.

  std::vector<BrickBits> near;            ///< By brick: the nodes at the ends of crossed edges.
  std::vector<std::uint32_t> loop_first;  ///< Scratch: by brick.

  std::uint32_t VertexCount() const { return edge_count + loop_count; }

  /// The first step of a cell. Its other steps follow in the order of CellLoops.
  std::uint32_t FirstStepOf(const ActiveCell& cell) const {
    return first_step[cell.first_loop - edge_count];
  }
  /// The vertices on the edges of a cell, by step.
  const std::uint32_t* StepEdgesOf(const ActiveCell& cell) const {
    return step_edges.data() + FirstStepOf(cell);
  }

  /// The vertex on the edge from a node along an axis. Requires: the edge is crossed.
  std::uint32_t EdgeVertex(const BrickPlace& node, int axis) const {
    const Brick& at = bricks[node.brick];
    const std::uint64_t below = (std::uint64_t{1} << node.Bit()) - 1;
    return at.first_edge + at.edges_before[axis][node.k] +
           static_cast<std::uint32_t>(CountBits(at.crossed[axis][node.k] & below));
  }
  /// Index of an active cell. Requires: the cell is active.
  std::uint32_t CellAt(const BrickPlace& place) const {
    const Brick& at = bricks[place.brick];
    const std::uint64_t below = (std::uint64_t{1} << place.Bit()) - 1;
    return at.first_cell + at.cells_before[place.k] +
           static_cast<std::uint32_t>(CountBits(at.active[place.k] & below));
  }
};

/// Sets all members of `crossings` except the steps (ListSteps). Deterministic, parallel over
/// bricks. Cost: linear in nodes.
void FindCrossings(const BrickDirectory& bricks, const SpaceField& field,
                   SpaceCrossings& crossings);

/// Lists the steps of all loops. Requires: FindCrossings. A separate function, so that the memory
/// of the counted loops can be reserved first. Cost: linear in cells.
void ListSteps(const BrickDirectory& bricks, SpaceCrossings& crossings);

/// The vertex on an edge of a cell. Requires: the edge is crossed.
inline std::uint32_t EdgeVertexOf(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                  const ActiveCell& cell, int edge) {
  const int corner = LowCornerOfEdge(edge);
  return crossings.EdgeVertex(Normalise(bricks, cell.brick, cell.i + (corner & 1),
                                        cell.j + (corner >> 1 & 1), cell.k + (corner >> 2)),
                              AxisOfEdge(edge));
}

/// The cell on the other side of a face. Requires: that cell is active.
inline std::uint32_t CellAcross(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                const ActiveCell& cell, int face) {
  std::array<int, 3> at{cell.i, cell.j, cell.k};
  at[face / 2] += (face & 1) != 0 ? 1 : -1;
  return crossings.CellAt(Normalise(bricks, cell.brick, at[0], at[1], at[2]));
}

/// The lowest node of a brick, in cells.
inline Vec3 OriginOf(const BrickCoordinate& brick) {
  return {8.0 * brick.x, 8.0 * brick.y, 8.0 * brick.z};
}

/// Calls visit(vertex, i, j, k, axis) for each crossed edge of a brick.
template <typename Visit>
void ForEachCrossedEdge(const SpaceCrossings& crossings, std::uint32_t brick, Visit visit) {
  std::uint32_t vertex = crossings.bricks[brick].first_edge;
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < kBrickSize; ++k) {
      for (std::uint64_t bits = crossings.bricks[brick].crossed[axis][k]; bits != 0;
           bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        visit(vertex++, bit % kBrickSize, bit / kBrickSize, k, axis);
      }
    }
  }
}

}  // namespace partiemc::space
