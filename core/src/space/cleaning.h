// Cleaning: makes nodes inside or outside before the crossings are found.
//
// Outside nodes are connected along lattice edges and diagonals of faces, because the surface
// separates the inside corners of an ambiguous face (cell_loops.h). A cavity is a connected set of
// outside nodes that inside nodes enclose. Only `SpaceField::inside` changes. Values of F stay,
// because no edge of a changed node is crossed afterwards.
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

/// Makes the nodes of all cavities of at most `most_nodes` nodes inside. Returns the number of
/// these cavities. Cost: linear in bricks, plus the square of `most_nodes` for each outside node
/// whose neighbours earlier by layer, row and column are all inside.
std::uint64_t FillCavities(const BrickDirectory& bricks, std::size_t most_nodes,
                           CleaningScratch& scratch, SpaceField& field);

struct BodyLimits {
  bool drops_empty = false;  ///< Drops bodies without particles.
  bool drops_gone = true;    ///< Drops bodies with the fate kGone.
  double least_volume = 0;   ///< Least Body::volume of a body that stays.
  std::uint64_t least_particles = 0;
};

/// Numbers of dropped bodies: without particles; below the least volume or number of particles.
struct DroppedBodies {
  std::uint64_t empty = 0, spray = 0;
};

/// Removes the bodies that `limits` requires, and bodies of images only, and makes their nodes
/// outside. The result counts the bodies below the limits, several images of a
/// body as one. The other bodies keep their order and particles. Particles of a body in a cavity do
/// not count for the body around it.
DroppedBodies DropBodies(const BodyLimits& limits, CleaningScratch& scratch, Bodies& bodies,
                         SpaceField& field);

}  // namespace partiemc::space
