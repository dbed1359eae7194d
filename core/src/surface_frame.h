// The particles of a surface with their images: copies beyond the faces of a periodic box, and
// mirror images behind walls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/surface_reconstructor.h"
#include "periodic/lift.h"
#include "space/bins.h"
#include "space_vertices/clipped_measures.h"
#include "walls/wall_images.h"

namespace partiemc {

/// The periodic box of a frame with copies. Infinite along axes without copies. World units.
struct CopiedBox {
  space::ClipBox faces;  ///< The faces of the box.
  /// Planes beyond the faces, two kernel radii before the end of the copies. A body within them is
  /// as if the copies had no end.
  space::ClipBox complete;
  bool any = false;  ///< Any axis has copies.
  std::array<bool, 3> has_copies{};
};

/// Warm buffers of AddImages.
struct SurfaceFrameScratch {
  LiftScratch lift;               // Empty without a periodic box.
  WallImageScratch images;        // Empty without walls.
  WallImageScratch before_walls;  // Empty unless a box has walls: the particles before the walls.
};

/// A frame with images.
struct SurfaceFrame {
  /// `frame`: the particles, their copies, then the mirror images of both. Without images, the
  /// given particles. `particles`: their number without images. If there are walls, only particles
  /// before them.
  LiftedFrame lifted;
  std::size_t first_mirror = 0;  ///< The number of particles and copies.
  CopiedBox copied;
  /// The space before the walls, and its part in the box. Absent without walls and without copies.
  std::optional<space::ClipBox> before_walls, in_box;
  space::GivenParticles names;  ///< The given particles, for errors.

  bool HasMirrors() const { return before_walls.has_value(); }
};

struct SurfaceFrameInput {
  const SurfaceParameters& parameters;
  const Frame& given;      ///< After ResolveBox.
  const SizeRange& sizes;  ///< Both 1 for equal sizes.
  /// Called with all bytes that the scratch requires so far, before they are allocated. Its error
  /// ends AddImages.
  absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve;
};

/// Lifts the particles out of the box, and adds copies and mirror images. `to` is a view of
/// `scratch` and of the given frame. Requires: CheckFrame has passed the frame, with three
/// components. Errors: as CheckBoxLengths, Lift and AddWallImages; OUT_OF_RANGE if two walls of one
/// axis are closer than the kernel radius of the largest particle. Cost: linear in particles and
/// images, plus Lift.
absl::Status AddImages(const SurfaceFrameInput& input, SurfaceFrameScratch& scratch,
                       SurfaceFrame& to);

}  // namespace partiemc
