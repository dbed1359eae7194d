// Stage 2: evaluates the level set at the nodes.
#pragma once

#include <array>
#include <vector>

#include "frame/scale.h"
#include "space/bins.h"
#include "space/lattice.h"

namespace partiemc::space {

struct SpaceField {
  /// F by brick, layer, row, column. Where `exact` is not set, only the sign of F is right.
  std::vector<std::array<float, kBrickNodes>> values;
  std::vector<BrickBits> inside;  ///< The nodes with F < 0.
  std::vector<BrickBits> exact;

  /// F at a node that exists.
  float At(const BrickPlace& node) const { return values[node.brick][node.Index()]; }
  bool IsInside(const BrickPlace& node) const {
    return node.brick != kNoIndex && (inside[node.brick][node.k] >> node.Bit() & 1) != 0;
  }
};

/// Finds the sides of all nodes, by F where the density does not decide the side. Parallel over
/// bricks. Cost: linear in particles and nodes, and in the kernels of the nodes near the surface.
void SampleField(const SpaceBins& bins, const Scale& scale, SpaceField& field);

/// Evaluates F at `nodes` of each brick, unless F is exact there. Nodes stay inside or outside as
/// before.
void EvaluateNodes(const SpaceBins& bins, const Scale& scale, const std::vector<BrickBits>& nodes,
                   SpaceField& field);

}  // namespace partiemc::space
