// Stage 1 of 7: particles -> tiles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "lattice.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "scale.h"

namespace partiemc {

/// Holes of the level set of up to this many particles' area lie on existing tiles throughout.
inline constexpr double kHoleMarginParticles = 6;

/// Particles sorted by tile. A particle stands in the list of every tile whose nodes or cells its
/// kernel reaches, so that a tile's field needs no other list. Tiles exist a little farther out:
/// so far that no isoline meets the end of the lattice, and no small hole leaves it.
///
/// Positions are relative to the tile's first node, in cells, rounded to multiples of 2^-17: every
/// one is an exact float in each tile that it stands in, hence the same particle everywhere.
struct ParticleBins {
  TileDirectory tiles;
  std::vector<std::uint32_t> offsets;  ///< Tile t has entries [offsets[t], offsets[t + 1]).
  std::vector<float> x, y;             ///< Cells, relative to the tile.
  std::vector<float> weight;           ///< w of the field, or empty: the uniform one.
  std::vector<std::uint32_t> source;   ///< Index of the particle in the frame.

  void Clear();
};

/// Whether a particle at (x, y) of a tile's list lies in the tile itself: true in exactly one list.
inline bool IsAtHome(float x, float y) {
  return x >= 0 && x < static_cast<float>(kTileSize) && y >= 0 && y < static_cast<float>(kTileSize);
}

/// Reads one coordinate pair of the frame, in world units.
struct WorldPosition {
  double x, y;
};
WorldPosition PositionOf(const Frame& frame, Plane plane, std::size_t particle);

/// A velocity in the plane. Requires: the frame has velocities.
struct PlaneVelocity {
  float x, y;
};
PlaneVelocity VelocityOf(const Frame& frame, Plane plane, std::size_t particle);

/// OK if every number of the frame is usable: coordinates finite and in one plane, volumes
/// positive, ids distinct, velocities finite. Errors: INVALID_ARGUMENT with a Violation that names
/// the first particle at fault.
absl::Status CheckFrame(const Frame& frame, Plane plane, const FrameLimits& limits);

/// Sorts the particles of a checked frame.
/// Errors: INVALID_ARGUMENT (a particle too many cells from the origin), RESOURCE_EXHAUSTED (more
/// tiles than allowed), each with a Violation.
/// Deterministic: entries of a tile stand in the order of the frame. Cost: linear.
absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins);

}  // namespace partiemc
