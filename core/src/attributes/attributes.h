// Stage 9 of 9: what particles carry -> values at the vertices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/result.h"

namespace partiemc {

/// A particle that vertices may be near to.
struct CarryingParticle {
  float x, y;            ///< Cells, relative to its tile.
  float height;          ///< Above the plane of a slice; else 0.
  float weight;          ///< w of the field.
  std::uint32_t source;  ///< Index in the frame.
};

/// Warm buffers of InterpolateAttributes.
struct AttributeScratch {
  std::vector<std::uint32_t> tile_of;   ///< By vertex.
  std::vector<std::uint8_t> is_wanted;  ///< By tile: a vertex lies in it or beside it.
  std::vector<std::uint32_t> buckets;   ///< By tile and bucket: its first particle.
  std::vector<CarryingParticle> particles;
};

/// Values of `frame.attributes` at the points of the rings, and then at those of the mesh that are
/// none of the rings: `values`, in the order of the frame's attributes, whose buffers are reused.
///
/// A value is that at the vertex of the plane (value over x and y) that fits the particles around
/// best, by least squares with the weights of the field, w k (paper, Eq. 1; Lancaster and
/// Salkauskas, Math. Comp. 37, 1981): a mean with the same kernel, without its error at the rim,
/// where all particles lie on one side. What is linear in the frame is so at the vertices. Of a
/// slice the kernel is that of space, and the value linear in the height, too. Slopes
/// that particles hardly tell, as of two in a drop, are drawn towards 0. 0 where no particle
/// is within the kernel radius.
///
/// Deterministic: particles are summed by tile and bucket, then in the order of the frame; in
/// parallel over vertices. Cost: linear in the particles of tiles with vertices, and in vertices
/// times particles within the kernel.
void InterpolateAttributes(const Frame& frame, const ParticleBins& bins, const Scale& scale,
                           const Rings& rings, const Mesh& mesh, AttributeScratch& scratch,
                           std::vector<AttributeValues>& values);

}  // namespace partiemc
