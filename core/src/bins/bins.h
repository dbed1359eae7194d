// Stage 1 of 9: particles -> tiles.
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

/// Holes of the level set of up to this many particles' area lie on existing tiles throughout.
inline constexpr double kHoleMarginParticles = 6;

/// A particle in the list of its tile.
struct BinnedParticle {
  float x, y;            ///< Cells, relative to the tile: in [0, 32).
  std::uint32_t source;  ///< Index of the particle in the frame.
};

/// Whether a particle lies in one of these cells of its tile.
inline bool LiesIn(const BinnedParticle& particle, const BitRows& cells) {
  return (cells[static_cast<int>(particle.y)] >> static_cast<int>(particle.x) & 1) != 0;
}

/// A stretch of successive particles: sorted by one task.
struct BinStretch {
  std::size_t first = 0, last = 0;  ///< Its particles are [first, last).
  TileDirectory homes;  ///< The tiles in which its particles lie, in the order in which they came.
  std::vector<std::uint32_t> tiles;   ///< By home: its place among those of all stretches; in the
                                      ///< end its tile.
  std::vector<std::uint32_t> places;  ///< By home: how many, then where the next one goes.
};

/// Warm buffers of BinParticles.
struct BinScratch {
  std::vector<BinStretch> all_stretches;  ///< Of frames so far: a small one leaves them warm.
  std::span<BinStretch> stretches;        ///< The first of them: those of this frame.
  std::vector<std::uint32_t> home;        ///< By particle: its home in its stretch.
  std::vector<float> positions;           ///< By particle: x and y in its home.
  std::vector<TileCoordinate> homes;      ///< Tiles that hold particles, sorted.
  std::vector<std::uint32_t> offsets;     ///< By these: their first particle.
  std::vector<std::uint32_t> next;        ///< By these: where the next stretch goes on.
  std::vector<std::uint32_t> reached;     ///< By these: tiles that must exist (AddReachedTiles).
};

/// Particles sorted by tile, each in the list of the tile that it lies in. Tiles exist farther out:
/// wherever a kernel reaches a node or a cell, and so far beyond that no isoline meets the end of
/// the lattice, and no small hole leaves it.
///
/// Positions are relative to the tile's first node, in cells, rounded to multiples of 2^-17: every
/// one is an exact float in its own tile and in each that its kernel reaches.
struct ParticleBins {
  TileDirectory tiles;
  std::vector<std::uint32_t> offsets;     ///< Tile t has particles [offsets[t], offsets[t + 1]).
  std::vector<BinnedParticle> particles;  ///< Tile after tile.
  std::vector<float> weight;              ///< By particle: w of the field; empty if all are equal.
  std::vector<float> height;  ///< By particle of a slice: cells above its plane; else empty.
  BinScratch scratch;

  std::uint32_t CountOf(std::size_t tile) const { return offsets[tile + 1] - offsets[tile]; }
  void Clear();
};

/// Sorts the particles of a checked frame.
/// Errors: INVALID_ARGUMENT (a particle too many cells from the origin), RESOURCE_EXHAUSTED (more
/// tiles than allowed), each with a Violation.
/// Deterministic: particles of a tile stand in the order of the frame. In parallel over stretches
/// of the frame: count, prefix sum, fill. Cost: linear.
absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins);

/// Tells bins, which hold the particles of a slab, their heights: by particle of that frame, in
/// world units.
void SetHeights(std::span<const double> heights, const Scale& scale, ParticleBins& bins);

}  // namespace partiemc
