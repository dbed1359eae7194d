// Lattice nodes that follow the vertices around them: auxiliary points of the certificate.
//
// A node of an active cell moves by the weighted mean displacement of the vertices in the
// eight cells around it and on its edges. Weights are 1 / distance^2 from the anchors. Smooth
// displacements then keep the cells in shape. Nodes of cells with several loops stay, as do nodes
// with a cell in a brick that does not exist.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/brick_layers.h"
#include "space/crossings.h"
#include "space/lattice.h"

namespace partiemc::space {

struct MovedNodes {
  struct Brick {
    BrickBits nodes{};  ///< Nodes that may move.
    BrickBits near{};   ///< Near cells: active cells, and cells with a node that may move.
    std::uint32_t first = 0;
    std::array<std::uint16_t, kBrickSize> before{};
  };
  std::vector<Brick> bricks;
  std::uint32_t count = 0;
  std::vector<Vec3> moves;                        ///< By node that may move. World units.
  std::vector<std::uint8_t> setbacks;             ///< By node that may move.
  std::vector<BrickBits> active, fixed, movable;  ///< Scratch: by brick.

  /// The index of a node, or kNoIndex if it stays.
  std::uint32_t IndexOf(const BrickPlace& node) const {
    if (node.brick == kNoIndex) return kNoIndex;
    const Brick& at = bricks[node.brick];
    if ((at.nodes[node.k] >> node.Bit() & 1) == 0) return kNoIndex;
    const std::uint64_t below = (std::uint64_t{1} << node.Bit()) - 1;
    return at.first + at.before[node.k] +
           static_cast<std::uint32_t>(CountBits(at.nodes[node.k] & below));
  }
};

/// Each round sets the vertices of refused faces back. The first kSmoothings setbacks of a vertex
/// replace its displacement by the mean move of the nodes around it. This makes an uneven face
/// even, but keeps the common displacement. Each later setback keeps kKeptOfMove of the
/// displacement, and setback number kMostSetbacks keeps nothing.
///
/// Nodes of a refused face are set back only if all its vertices are at their anchors. Otherwise a
/// node would stay behind vertices that keep their displacement, and the faces beside it would be
/// refused in turn: whole patches of vertices would return. Each setback of a node keeps
/// kKeptOfMove of its move, and setback number kMostSetbacks keeps nothing.
inline constexpr int kSmoothings = 4;
inline constexpr int kMostSetbacks = 12;
inline constexpr double kKeptOfMove = .7;

/// Finds the nodes that may move, and sets their moves and setbacks to 0. `is_settled`: by vertex,
/// whether it stays at its anchor with all vertices of its body; empty if none does. Nodes of cells
/// with settled vertices stay, and these cells are near only for other reasons. Parallel over
/// bricks.
void FindMovedNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                    std::span<const std::uint8_t> is_settled, MovedNodes& nodes);

/// The nodes of a layer that are corners of cells among `cells`.
std::uint64_t CornersOf(const BrickLayers& cells, int k);

/// Sets the moves of the nodes of a brick that are in `which` and may move. Returns the nodes
/// whose moves changed. Anchors and positions are in world units.
BrickBits MoveNodesOf(std::uint32_t brick, const BrickBits& which, const BrickDirectory& bricks,
                      const SpaceCrossings& crossings, double cell_size,
                      const std::vector<Vec3>& anchors, const std::vector<Vec3>& positions,
                      MovedNodes& nodes);

/// The moved position, in world units, of the node `at`, which is relative to a brick.
inline Vec3 NodeAt(const BrickDirectory& bricks, const MovedNodes& nodes, double cell_size,
                   std::uint32_t brick, const std::array<int, 3>& at) {
  const Vec3 origin = OriginOf(bricks[brick]);
  const Vec3 rest{cell_size * (origin.x + at[0]), cell_size * (origin.y + at[1]),
                  cell_size * (origin.z + at[2])};
  const std::uint32_t node = nodes.IndexOf(Normalise(bricks, brick, at[0], at[1], at[2]));
  return node == kNoIndex ? rest : rest + nodes.moves[node];
}

/// Calls visit(index, i, j, k) for each node of a brick that may move and is in `which`.
template <typename Visit>
void ForEachMovedNodeOf(const MovedNodes& nodes, std::uint32_t brick, const BrickBits& which,
                        Visit visit) {
  const MovedNodes::Brick& at = nodes.bricks[brick];
  for (int k = 0; k < kBrickSize; ++k) {
    for (std::uint64_t bits = at.nodes[k] & which[k]; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      const std::uint64_t below = at.nodes[k] & ((bits & (~bits + 1)) - 1);
      visit(at.first + at.before[k] + static_cast<std::uint32_t>(CountBits(below)),
            bit % kBrickSize, bit / kBrickSize, k);
    }
  }
}

/// Calls visit(index, i, j, k) for each node of a brick that may move.
template <typename Visit>
void ForEachMovedNode(const MovedNodes& nodes, std::uint32_t brick, Visit visit) {
  ForEachMovedNodeOf(nodes, brick, nodes.bricks[brick].nodes, visit);
}

}  // namespace partiemc::space
