// The floor: the least that any reconstruction of a field from particles does. A counting sort by
// tiles of 32 x 32 nodes, then the density alone, scattered particle by particle along rows of one
// dense lattice of spacing 1. No level set, no moments, no list of tiles, no checks, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace partiemc::bench {

/// Nodes (column, row) of a dense lattice of spacing 1.
struct LatticeBox {
  int first_column = 0, first_row = 0;
  int columns = 0, rows = 0;

  std::size_t NodeCount() const { return static_cast<std::size_t>(columns) * rows; }
  /// The smallest with `margin` nodes beyond every particle, to all sides.
  static LatticeBox Around(std::span<const float> xy, int margin);
};

/// Buffers of the floor, warm from frame to frame.
struct ScatterBuffers {
  std::vector<std::uint32_t> tile_of;  // By particle.
  std::vector<std::uint32_t> offsets;  // By tile.
  std::vector<float> sorted;           // x, y by tile.
  std::vector<float> density;          // By row; rows are `stride` apart.
  std::size_t stride = 0;
};

/// density[node] = sum over particles of max(0, (1 - d^2 / R^2)^3) for the nodes of `box`, R being
/// `kernel_radius` spacings: 2 or 3. Requires: box made by Around with a margin of at least R.
/// Uses AVX2 where the processor has it.
void ScatterDensity(std::span<const float> xy, const LatticeBox& box, int kernel_radius,
                    ScatterBuffers& buffers);

/// The instruction set that ScatterDensity uses here.
std::string ScatterInstructionSet();

}  // namespace partiemc::bench
