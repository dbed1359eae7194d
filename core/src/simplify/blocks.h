// Simplifies triangles by meshoptimizer, in blocks that are small enough for its precision.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace partiemc::simplify {

struct BlockLimits {
  double error = 0;        ///< Limit of the root mean square error, in world units.
  double least_block = 1;  ///< Least side of a block, in world units.
};

/// Collapses edges of `triangles`, triples of indices into `points`. Points on the border of the
/// triangles stay. Guarantees neither manifold triangles nor the error.
/// meshoptimizer sums floats relative to the extent of its input, so an input larger than a block
/// is cut into blocks, whose borders stay. A second pass, with blocks moved by half a side,
/// simplifies these borders. Deterministic for any number of threads.
void SimplifyInBlocks(std::span<const double> points, const BlockLimits& limits,
                      std::vector<std::uint32_t>& triangles);

}  // namespace partiemc::simplify
