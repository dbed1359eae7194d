// Cleaning: changes the sides of nodes before the surface is made.
//
// Outside nodes are connected along lattice edges and diagonals of faces, as the surface separates
// the inside corners of an ambiguous face (cell_loops.h). A cavity is a connected set of outside
// nodes that inside nodes enclose. Values of F stay as they are: no edge of a changed node is
// crossed.
#pragma once

#include <cstdint>
#include <vector>

#include "space/bodies.h"
#include "space/field.h"
#include "space/lattice.h"

namespace partiemc::space {

struct CleaningScratch {
  std::vector<BrickBits> first_nodes;    ///< By brick: nodes that may be the first of a cavity.
  std::vector<BrickPlace> cavity;        ///< Nodes of one cavity.
  std::vector<std::uint32_t> new_index;  ///< By body, or kNoIndex.
};

/// Makes the nodes of cavities inside that have at most `most_nodes` nodes. Returns the number of
/// these cavities. Cost: linear in bricks, with words of 64 nodes.
std::uint64_t FillCavities(const BrickDirectory& bricks, std::size_t most_nodes,
                           CleaningScratch& scratch, SpaceField& field);

struct BodyLimits {
  bool drops_empty = false;  ///< Bodies without particles.
  double least_volume = 0;   ///< Of the particles of a body, world units cubed.
  std::uint64_t least_particles = 0;
};

struct DroppedBodies {
  std::uint64_t empty = 0, spray = 0;
};

/// Removes the bodies below the limits, and makes their nodes outside. The other bodies keep their
/// order and their particles. A body in a cavity is judged by its own particles.
DroppedBodies DropBodies(const BodyLimits& limits, CleaningScratch& scratch, Bodies& bodies,
                         SpaceField& field);

}  // namespace partiemc::space
