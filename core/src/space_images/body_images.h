// Decides which bodies of a frame with copies of particles remain whole, are dropped, or are cut at
// the faces of the periodic box.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "partiemc/frame.h"
#include "partiemc/surface.h"
#include "periodic/lift.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/mesh.h"

namespace partiemc::space {

struct BodyImageInput {
  const LiftedFrame& lifted;
  const SpaceBins& bins;
  /// The planes, as corners of a box. In this box the surface is the same as with copies without
  /// end. Infinite along axes without copies. World units.
  Vec3 low, high;
  double spacing, cell_size;  ///< World units.
  bool wraps = false;         ///< PeriodicBox::wraps.
};

/// Warm buffers of ChooseImages.
struct BodyImageScratch {
  struct Image {
    Vec3 low, high;                ///< Bounding box of its nodes, in cells.
    std::uint32_t set = kNoIndex;  ///< Union-find: an image of the same body, or itself.
    std::uint64_t given = 0;       ///< Number of its particles that are not copies.
    bool has_copies = false;       ///< Whether it has copies; for the first image: whether any has.
    // Set for the first image only, over all images:
    std::uint64_t particles = 0;
    double volume = 0;
    std::uint32_t best = kNoIndex;  ///< The image that remains whole.
  };
  std::vector<Image> images;           ///< By body.
  std::vector<std::uint32_t> body_of;  ///< By particle of the frame.
};

/// Sets the fate and the first image of each body of a frame with copies. Bodies that share a
/// particle, given or copied within the planes, are images of one body.
///   - A body without copies remains whole.
///   - Among the images within the planes, the image with the most given particles remains whole,
///     at a tie the first one. The other images are dropped.
///   - All images are cut if there is no such image, or if it has more or fewer particles than the
///     body. If the box wraps, all images of bodies with copies are cut.
/// Sets the particles and the volume of each image to the sum over all images. If a given particle
/// has no body but a copy of it has one, the particle counts for the body of the copy. In
/// body_of_particle it gets kDroppedBody, so that no ellipsoid (drops.h) replaces it. In a box that
/// wraps, copies without a body get kDroppedBody, too, if their particle or another copy has one.
/// Requires: FindBodies. Deterministic. Cost: linear in particles and parts.
void ChooseImages(const BodyImageInput& input, BodyImageScratch& scratch, Bodies& bodies);

/// Removes the triangles and the particles (kDroppedBody) of bodies with the fate kGone.
/// `body_of_vertex`: by vertex of SpaceCrossings; triangles of ellipsoids have further vertices.
void RemoveGoneImages(std::span<const std::uint32_t> body_of_vertex, Bodies& bodies,
                      std::vector<VertexTriangle>& triangles);

/// The shells of the bodies that are cut.
struct CutShells {
  bool any = false;
  /// By shell: 0 if it is not cut, else 1, or kLoneDrop for the ellipsoid of a particle without a
  /// body. The ellipsoid's node counts for identities even outside of the box.
  std::vector<std::uint8_t> is_cut;
  static constexpr std::uint8_t kLoneDrop = 2;
  /// By shell: its outer shell; for a shell of a cut body, the first outer shell of all images.
  std::vector<std::uint32_t> outer_of;
  std::vector<std::uint32_t> first;  ///< Scratch: by body.
};

/// Finds the shells of bodies that are cut, cavities included. `body_of_shell`: by shell, its body;
/// kNoIndex for an ellipsoid of a particle without a body. Cost: linear in shells and bodies.
void FindCutShells(const Bodies& bodies, std::span<const std::uint32_t> body_of_shell,
                   const Surface& surface, CutShells& shells);

}  // namespace partiemc::space
