// Stage 1 of 7: particles -> tiles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "frame_view.h"
#include "lattice.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "scale.h"

namespace partiemc {

/// Holes of the level set of up to this many particles' area lie on existing tiles throughout.
inline constexpr double kHoleMarginParticles = 6;

/// A particle in the list of a tile.
struct BinEntry {
  float x, y;            ///< Cells, relative to the tile.
  std::uint32_t source;  ///< Index of the particle in the frame.
};

/// A stretch of successive particles: sorted by one task. Home tiles are those in which its
/// particles lie, in the order in which they were met; what is known of them is kept apart by the
/// pass that asks for it, so that each pass stays in the nearest cache.
struct BinStretch {
  TileDirectory homes;
  /// By home tile: particles by the sides of the tile that their kernels cross: bit 0 left, 1
  /// right, 2 lower, 3 upper. A kernel may cross opposite sides.
  std::vector<std::array<std::uint32_t, 16>> crossing;
  /// By home tile: bit 5 (dy + 2) + dx + 2 is set if the tile at (dx, dy) from it must exist.
  std::vector<std::uint32_t> reached;
  std::vector<std::uint32_t> tile;  ///< By home tile: its index in the frame's directory.
  std::vector<std::uint32_t>
      entries;  ///< By tile of the frame: how many, then where the next goes.
};

/// Warm buffers of BinParticles.
struct BinScratch {
  std::vector<BinStretch> stretches;
  std::vector<std::uint32_t> home;  ///< By particle: home tile in its stretch, and sides crossed.
  std::vector<float> positions;     ///< By particle: x and y in its home tile.
  std::vector<std::uint32_t> reached;  ///< By home tile: as in BinStretch, of all stretches.
};

/// Particles sorted by tile. A particle stands in the list of every tile whose nodes or cells its
/// kernel reaches, so that a tile's field needs no other list. Tiles exist a little farther out:
/// so far that no isoline meets the end of the lattice, and no small hole leaves it.
///
/// Positions are relative to the tile's first node, in cells, rounded to multiples of 2^-17: every
/// one is an exact float in each tile that it stands in, hence the same particle everywhere.
struct ParticleBins {
  TileDirectory tiles;
  std::vector<std::uint32_t> offsets;     ///< Tile t has entries [offsets[t], offsets[t + 1]).
  std::vector<std::uint32_t> home_count;  ///< By tile: how many of them lie in the tile itself.
  std::vector<BinEntry> entries;          ///< Tile after tile.
  std::vector<float> weight;              ///< By entry: w of the field; empty if all are equal.
  BinScratch scratch;

  void Clear();
};

/// Whether an entry's particle lies in the tile itself: true in exactly one list.
inline bool IsAtHome(const BinEntry& entry) {
  constexpr auto kSize = static_cast<float>(kTileSize);
  return entry.x >= 0 && entry.x < kSize && entry.y >= 0 && entry.y < kSize;
}

/// Sorts the particles of a checked frame.
/// Errors: INVALID_ARGUMENT (a particle too many cells from the origin), RESOURCE_EXHAUSTED (more
/// tiles than allowed), each with a Violation.
/// Deterministic: entries of a tile stand in the order of the frame. In parallel over stretches of
/// the frame: count, prefix sum, fill. Cost: linear.
absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins);

}  // namespace partiemc
