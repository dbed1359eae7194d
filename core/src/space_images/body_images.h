// Decides which bodies of a frame with copies of particles are whole, and which are cut at the
// faces of the periodic box.
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

namespace partiemc::space {

struct BodyImageInput {
  const LiftedFrame& lifted;
  const SpaceBins& bins;
  /// Bodies within these planes are complete; infinite along axes without copies. World units.
  Vec3 low, high;
  double spacing, cell_size;  ///< World units.
  bool wraps = false;         ///< PeriodicBox::wraps.
};

/// Warm buffers of ChooseImages.
struct BodyImageScratch {
  struct Image {
    Vec3 low, high;                ///< Bounding box of its nodes, in cells.
    std::uint32_t set = kNoIndex;  ///< A body of the same set, with a smaller or the same index.
    std::uint64_t given = 0;       ///< Its particles without copies.
    bool has_copies = false;       ///< Of its set.
    // Only the first body of a set has these:
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
///   - If there is no such image, or it lacks particles of the body, all images are cut. If the box
///     wraps, this is so for all bodies with copies.
/// Sets the particles and the volume of each body to the sum of all its images. If a particle has
/// no body but its copy has one, it belongs to this body, and its own body is kDroppedBody, so that
/// it does not become a drop; in a box that wraps, the same for copies. Bodies without particles
/// remain whole.
/// Requires: FindBodies. Deterministic. Cost: linear in particles and parts.
void ChooseImages(const BodyImageInput& input, BodyImageScratch& scratch, Bodies& bodies);

/// The shells of the bodies that are cut.
struct CutShells {
  bool any = false;
  /// By shell: not 0. kLoneDrop for the ellipsoid of a particle without a body, which counts for
  /// identities although its node may lie outside of the box.
  std::vector<std::uint8_t> is_cut;
  static constexpr std::uint8_t kLoneDrop = 2;
  std::vector<std::uint32_t> outer_of;  ///< By shell: the first outer shell of its body.
  std::vector<std::uint32_t> first;     ///< Scratch: by body.
};

/// Finds the shells of bodies that are cut, cavities included. `body_of_shell`: the body of each
/// shell, or kNoIndex for an ellipsoid. Linear in shells and bodies.
void FindCutShells(const Bodies& bodies, std::span<const std::uint32_t> body_of_shell,
                   const Surface& surface, CutShells& shells);

}  // namespace partiemc::space
