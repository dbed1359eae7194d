// The particles around a few points, as they lie in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace partiemc {

/// Vectors may read so many particles past the end of a row of buckets.
inline constexpr int kRowPadding = 16;

/// A query asks for sums at up to so many points, which look at the same particles: those of four
/// segments.
inline constexpr std::size_t kPointsAtOnce = 8;
/// So many queries run at once: none waits for what is looked up for another.
inline constexpr std::size_t kQueriesAtOnce = 6;

/// Positions along x are told modulo this many cells, which is more than any points see of them.
inline constexpr float kColumnPeriod = 128;

/// Successive buckets of successive rows, of tiles side by side.
struct NeighbourBand {
  const std::uint32_t* offsets;  ///< The first particle of the first bucket, and so on.
  int columns, rows;             ///< Buckets to look at.
  int row_stride;                ///< Buckets from one row to the next.
  float origin_y;                ///< NeighbourRows::origin_y, relative to those tiles.
};

/// Particles around points of a tile: row after row of buckets, each row a contiguous span. Not
/// initialised: most points need one band.
struct NeighbourRows {
  const float* x;       ///< By particle, in cells, modulo kColumnPeriod.
  const float* y;       ///< By particle, in cells relative to the tile that it lies in.
  const float* weight;  ///< By particle; null where all weigh Scale::uniform_weight.
  /// The corner of a cell near the points, relative to the tile: sums run in floats, in coordinates
  /// relative to it.
  float origin_x, origin_y;
  float column;  ///< Where it is among `x`.
  /// Only particles in this disc count, whose centre is relative to the origin.
  float centre_x, centre_y, reach_square;
  std::array<NeighbourBand, 3> bands;
  int band_count;
};

}  // namespace partiemc
