// The mirror images of particles behind plane walls of a surface.
//
// Kernels see no particles beyond a wall. With the images, the fluid continues through the wall,
// and the stages of a surface need no wall. The surface is cut at the wall afterwards.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Scratch of AddWallImages.
struct WallImageScratch {
  std::vector<double> positions;
  std::vector<std::uint32_t> originals;  // The given particle of each particle.
  std::vector<float> volumes, velocities;
  std::vector<std::uint64_t> ids;
  std::vector<std::vector<float>> values;  // By attribute.
  std::vector<Attribute> attributes;
};

/// The space before all walls. Without a wall, a side is infinite.
struct FluidBox {
  std::array<double, 3> low, high;
};
FluidBox FluidBoxOf(std::span<const WallPlane> planes);

struct WallImageInput {
  const Frame& frame;
  std::span<const WallPlane> planes;
  /// Particles have images if they are at most this far before a wall. World units.
  double depth = 0;
  /// With own sizes, the kernel radius in sizes: the particles must be nearer than `depth` plus
  /// their own kernel radius. 0: equal sizes.
  double kernel_radius = 0;
  /// Particles farther behind a wall than this have no effect. World units; with own sizes, in
  /// sizes.
  double tolerance = 0;
  /// Closer particles move to this distance before a wall. Units as `tolerance`.
  double nearest = 0;
  /// Called with the bytes that the scratch requires, before they are allocated. Its error ends
  /// AddWallImages.
  absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve;
};

/// Sets `with_images` to particles and their images, a view of `scratch`. The particles come first,
/// in their order: those before the walls or up to `tolerance` behind one. Particles closer than
/// `nearest` to a wall or behind it move to this distance before it. `particles`: their number. At
/// edges and corners, images have images behind the walls of the next axes. An image has the id,
/// volume and attributes of its particle, and its velocity, mirrored. With `depth` 0 there are no
/// images.
/// Requires: CheckFrame has passed the frame, with three components and, with own sizes, volumes.
/// Errors: INVALID_ARGUMENT (TOO_MANY_PARTICLES) for more than FrameLimits::kMostParticles with the
/// images; errors of `reserve`. Cost: linear in particles.
absl::Status AddWallImages(const WallImageInput& input, WallImageScratch& scratch,
                           Frame& with_images, std::size_t& particles);

}  // namespace partiemc
