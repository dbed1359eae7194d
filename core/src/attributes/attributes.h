// Stage 9 of 9: attributes of particles -> values at the vertices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "frame/particle_subset.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/result.h"

namespace partiemc {

/// A particle of a tile near vertices.
struct CarryingParticle {
  float x, y;            ///< Cells, relative to its tile.
  float height;          ///< Cells above the plane of a slice; 0 without a slice.
  float weight;          ///< The weight w_i (METHOD.md, "Notation").
  std::uint32_t source;  ///< Index in the frame.
};

/// Warm buffers of InterpolateAttributes.
struct AttributeScratch {
  std::vector<std::uint32_t> tile_of;   ///< By vertex: its tile, or kNoTile.
  std::vector<float> inverse_size;      ///< By particle: 1 / size in spacings; empty: equal sizes.
  std::vector<std::uint8_t> is_wanted;  ///< By tile: not 0 if the tile or a neighbour has a vertex.
  std::vector<std::uint8_t> sorted;     ///< By tile: whether its particles are sorted already.
  std::vector<std::uint32_t> buckets;   ///< By tile and bucket: first particle.
  std::vector<CarryingParticle> particles;
};

/// Interpolates the attributes of the particles in `subset` to `vertices`: x0, y0, x1, ... in world
/// units. `values` receives one entry for each attribute of `frame`, in the same order, and reuses
/// its buffers.
///
/// Fits a plane (attribute over x and y, in a slice also over the height) to the particles within
/// the kernel radius, and evaluates the plane at the vertex. The fit is a least-squares fit with
/// the weights w k of the field (moving least squares; Lancaster and Salkauskas, Math. Comp. 37,
/// 1981). A weighted mean would be wrong at the rim of a body, where all particles lie on one side.
/// The fit damps slopes that the particles barely determine, such as in a drop of two particles. A
/// vertex without a particle of `subset` within the kernel radius gets the value 0.
///
/// Requires: a checked frame (frame/frame_view.h). Several calls may share `scratch` and its sorted
/// particles; before the first call for other bins, the caller clears `scratch.sorted`.
/// Deterministic: sums run by tile and bucket, then in the order of the frame. Parallel over
/// vertices. Cost: linear in the particles of tiles near vertices, plus the particles within the
/// kernel radius of each vertex.
void InterpolateAttributes(const Frame& frame, const ParticleBins& bins, const Scale& scale,
                           std::span<const double> vertices, AttributeScratch& scratch,
                           std::vector<AttributeValues>& values, const ParticleSubset& subset = {});

/// The vertices that attributes are interpolated to: the points of the rings, then the other points
/// of the mesh.
std::span<const double> VerticesOf(const Rings& rings, const Mesh& mesh);

}  // namespace partiemc
