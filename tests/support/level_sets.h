// Random level sets on a small lattice, including ones that no particles produce.
#pragma once

#include <cstddef>
#include <vector>

#include "support/random.h"

namespace partiemc::support {

/// Values at the nodes [0, columns) x [0, rows); outside of them 1, which is outside the body.
struct LevelSetPatch {
  int columns = 0, rows = 0;
  std::vector<float> values;  // Row by row.

  float At(int x, int y) const {
    const bool is_inside = x >= 0 && y >= 0 && x < columns && y < rows;
    return is_inside ? values[static_cast<std::size_t>(y * columns + x)] : 1.0f;
  }
};

/// One of: noise, extreme ratios of neighbours, values near 0, checkerboards (a saddle in every
/// cell) with and without defects, smooth fields, walls, and fields of -1, 0 and 1.
LevelSetPatch RandomPatch(Random& random, int columns, int rows);

/// Only -1, 0 and 1: every crossing is in the middle of an edge or at a node; saddles are ties.
LevelSetPatch TernaryPatch(Random& random, int columns, int rows);

}  // namespace partiemc::support
