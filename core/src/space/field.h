// Stage 2: evaluates the level set at the nodes.
#pragma once

#include <array>
#include <vector>

#include "frame/scale.h"
#include "space/bins.h"
#include "space/lattice.h"

namespace partiemc::space {

struct SpaceField {
  /// F in cells, by brick, layer, row, column. Where `exact` is not set, only the sign is right.
  std::vector<std::array<float, kBrickNodes>> values;
  std::vector<BrickBits> inside;  ///< The nodes with F < 0, except where cleaning has changed this.
  std::vector<BrickBits> exact;   ///< The nodes where `values` is F.

  /// F at a node that exists.
  float At(const BrickPlace& node) const { return values[node.brick][node.Index()]; }
  bool IsInside(const BrickPlace& node) const {
    return node.brick != kNoIndex && (inside[node.brick][node.k] >> node.Bit() & 1) != 0;
  }
};

/// Finds which nodes are inside: by the density where it decides this, else by F. Parallel over
/// bricks. Cost: linear in particles and nodes, and in the kernels of the nodes near the surface.
void SampleField(const SpaceBins& bins, const Scale& scale, SpaceField& field);

/// Evaluates F at the nodes among `nodes`, by brick, where F is not exact yet. Nodes stay inside or
/// outside as before: if rounding gives F the other sign, F becomes 0 or just below 0.
void EvaluateNodes(const SpaceBins& bins, const Scale& scale, const std::vector<BrickBits>& nodes,
                   SpaceField& field);

}  // namespace partiemc::space
