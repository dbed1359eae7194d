// Where the particles around the points of one query lie in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace partiemc {

/// Loads of vectors may read up to this many particles past the end of a row of buckets.
inline constexpr int kRowPadding = 16;

/// Most points of a query, which share their particles: two points for each of four segments.
inline constexpr std::size_t kPointsAtOnce = 8;
/// Most queries that run at once, so that their memory accesses overlap.
inline constexpr std::size_t kQueriesAtOnce = 6;

/// Positions along x are modulo this number of cells, which is more than any query spans.
inline constexpr float kColumnPeriod = 128;

/// Consecutive buckets in consecutive rows of a run of tiles.
struct NeighbourBand {
  const std::uint32_t* offsets;  ///< By bucket of the first row: its first particle.
  int columns, rows;             ///< Numbers of buckets to visit.
  int row_stride;                ///< Buckets from one row to the next.
  float origin_y;                ///< NeighbourRows::origin_y, relative to the run's tiles.
};

/// The particles around points of a tile: one range for each row of buckets. Members are not
/// initialised, because most queries need only one band. The arrays belong to the sampler.
struct NeighbourRows {
  const float* x;       ///< By particle, in cells, modulo kColumnPeriod.
  const float* y;       ///< By particle, in cells relative to its own tile.
  const float* weight;  ///< By particle; null if all have Scale::uniform_weight.
  const float* size;    ///< By particle, in spacings; null if equal. If set, `weight` is null.
  /// The corner of a cell near the points, in cells relative to the tile. Sums use floats relative
  /// to this corner.
  float origin_x, origin_y;
  float column;  ///< The origin in the coordinates of `x`.
  /// Only particles in this disc count. Its centre is relative to the origin. If sizes differ, the
  /// disc of a particle has the radius reach + reach_per_size times its size.
  float centre_x, centre_y, reach_square;
  float reach, reach_per_size;
  std::array<NeighbourBand, 3> bands;
  int band_count;
};

}  // namespace partiemc
