// The particles around a few points, as they lie in memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace partiemc {

/// Vectors may read so many entries past the end of a row.
inline constexpr int kRowPadding = 16;

/// A query asks for sums at up to so many points: neighbours, which look at the same particles.
inline constexpr std::size_t kPointsAtOnce = 2;
/// So many queries run at once: none waits for what is looked up for another.
inline constexpr std::size_t kQueriesAtOnce = 8;

/// Entries around points of a tile: row after row of buckets, each row a contiguous span.
struct NearRows {
  const float *x, *y;            ///< By entry, in cells relative to the tile.
  const float* weight;           ///< By entry; null where all weigh Scale::uniform_weight.
  const std::uint32_t* offsets;  ///< First bucket of the first row.
  int rows, columns;             ///< Buckets to look at.
  int row_stride;                ///< Buckets from one row to the next.
  /// The corner of a cell near the points: sums run in floats, in coordinates relative to it.
  float origin_x, origin_y;
};

}  // namespace partiemc
