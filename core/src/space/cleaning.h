// Cleaning: changes the sides of nodes before the surface is made.
//
// Outside nodes are connected along lattice edges and diagonals of faces, because the surface
// separates the inside corners of an ambiguous face (cell_loops.h). A cavity is a connected set of
// outside nodes that inside nodes enclose. Values of F stay as they are, because no edge of a
// changed node is crossed afterwards.
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
  std::vector<std::uint32_t> new_index;  ///< By body: its new index, or kNoIndex.
};

/// Fills the cavities of at most `most_nodes` nodes: makes their nodes inside. Returns the number
/// of filled cavities. Cost: linear in bricks, with words of 64 nodes.
std::uint64_t FillCavities(const BrickDirectory& bricks, std::size_t most_nodes,
                           CleaningScratch& scratch, SpaceField& field);

struct BodyLimits {
  bool drops_empty = false;  ///< Drops bodies without particles.
  double least_volume = 0;   ///< Least volume of its particles, world units cubed.
  std::uint64_t least_particles = 0;
};

struct DroppedBodies {
  std::uint64_t empty = 0, spray = 0;
};

/// Removes the bodies below the limits, images with the fate kGone, and bodies that have mirror
/// images only, and makes their nodes outside. Only the bodies below the limits count, several
/// images of a body as one. The other bodies keep their order and their particles. For a body, the
/// particles of bodies in its cavities do not count.
DroppedBodies DropBodies(const BodyLimits& limits, CleaningScratch& scratch, Bodies& bodies,
                         SpaceField& field);

}  // namespace partiemc::space
