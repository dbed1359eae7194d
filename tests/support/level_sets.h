// Level sets of random numbers, at nodes of a small lattice: what no particles would ever make.
#pragma once

#include <cstddef>
#include <vector>

#include "support/random.h"

namespace partiemc::support {

/// Values at the nodes [0, columns) x [0, rows); outside of them 1, hence outside.
struct LevelSetPatch {
  int columns = 0, rows = 0;
  std::vector<float> values;  // Row by row.

  float At(int x, int y) const {
    const bool is_inside = x >= 0 && y >= 0 && x < columns && y < rows;
    return is_inside ? values[static_cast<std::size_t>(y * columns + x)] : 1.0f;
  }
};

/// One of: noise, extreme ratios of neighbours, values next to 0, checkerboards (a saddle in every
/// cell) with and without faults, smooth fields, walls, and fields of nothing but -1, 0 and 1.
LevelSetPatch RandomPatch(Random& random, int columns, int rows);

/// -1, 0 and 1 only: every crossing at the middle of an edge or at a node, saddles that are ties.
LevelSetPatch TernaryPatch(Random& random, int columns, int rows);

}  // namespace partiemc::support
