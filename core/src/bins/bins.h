// Stage 1 of 9: sorts the particles of a frame into tiles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "bins/lattice.h"
#include "frame/frame_view.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Area, in squared spacings, of the largest hole that is sure to lie completely on tiles.
inline constexpr double kHoleMarginParticles = 6;

/// A particle in the list of its tile.
struct BinnedParticle {
  float x, y;            ///< Cells, relative to the tile: in [0, 32).
  std::uint32_t source;  ///< Index of the particle in the frame.
};

/// Whether a particle lies in one of the marked cells of its tile.
inline bool LiesIn(const BinnedParticle& particle, const BitRows& cells) {
  return (cells[static_cast<int>(particle.y)] >> static_cast<int>(particle.x) & 1) != 0;
}

/// Consecutive particles that one task sorts.
struct BinStretch {
  std::size_t first = 0, last = 0;    ///< Its particles are [first, last).
  TileDirectory homes;                ///< The tiles of its particles, by first occurrence.
  std::vector<std::uint32_t> tiles;   ///< By home: index in BinScratch::homes; later the tile.
  std::vector<std::uint32_t> places;  ///< By home: the count; later the next particle's index.
};

/// Warm buffers of BinParticles.
struct BinScratch {
  std::vector<BinStretch> all_stretches;  ///< Kept for later, larger frames.
  std::span<BinStretch> stretches;        ///< The first of all_stretches: those of this frame.
  std::vector<std::uint32_t> home;        ///< By particle: index in BinStretch::homes.
  std::vector<float> positions;           ///< By particle: x and y in its tile.
  std::vector<TileCoordinate> homes;      ///< The tiles with particles, sorted.
  std::vector<std::uint32_t> offsets;     ///< By home: its first particle.
  std::vector<std::uint32_t> next;        ///< By home: first index for the next stretch.
  std::vector<std::uint32_t> reached;     ///< By home: the tiles around it (TileHalo).
};

/// Particles by tile. Tiles without particles exist where a kernel reaches a node or a cell, and in
/// a margin around it. The margin contains small holes completely, and no outline meets the end of
/// the lattice.
///
/// Positions are relative to the first node of the tile, in cells, rounded to multiples of 2^-17. A
/// position is an exact float in its own tile and in each tile that its kernel reaches.
struct ParticleBins {
  TileDirectory tiles;
  std::vector<std::uint32_t> offsets;     ///< Tile t has particles [offsets[t], offsets[t + 1]).
  std::vector<BinnedParticle> particles;  ///< Tile after tile.
  std::vector<float> weight;              ///< By particle: its weight w; empty without volumes.
  std::vector<float> height;              ///< By particle of a slice: height in cells; else empty.
  std::vector<float> size;                ///< By particle: size in spacings; empty for equal sizes.
  BinScratch scratch;

  std::uint32_t CountOf(std::size_t tile) const { return offsets[tile + 1] - offsets[tile]; }
  void Clear();
};

/// Checks that all coordinates are within 2^30 cells of the origin. `scale`: `cell_size` and
/// `is_slice` are set. Errors: INVALID_ARGUMENT with a Violation for the first particle that is too
/// far. For a slice, the Violation names only `positions`. Cost: linear, serial.
absl::Status CheckDistances(const Frame& frame, Plane plane, const Scale& scale);

/// Sorts the particles of a checked frame by tile, in the order of the frame within a tile.
/// Parallel over stretches of the frame: count, prefix sum, fill. Deterministic. Cost: linear.
/// Errors with a Violation: as CheckDistances; RESOURCE_EXHAUSTED (more tiles than allowed).
absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins);

/// Sets the heights of the particles of a slab. `heights`: by particle of the slab, in world units.
void SetHeights(std::span<const double> heights, const Scale& scale, ParticleBins& bins);

}  // namespace partiemc
