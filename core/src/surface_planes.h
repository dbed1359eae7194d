// Surfaces that end at planes: walls, and the faces of a periodic box.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/surface.h"
#include "partiemc/surface_reconstructor.h"
#include "periodic/lift.h"
#include "space_cut/surface_cut.h"
#include "space_images/body_images.h"
#include "space_vertices/clipped_measures.h"

namespace partiemc {

/// Warm buffers of CutAtWalls and CutAtBox.
struct PlaneCuts {
  std::vector<space::AxisPlane> planes;
  std::vector<std::uint8_t> is_cut;  // By shell.
  space::SurfaceCutScratch cut;
  space::SurfacePieces pieces;
};

/// Copies of particles reach kCopyMargin kernel radii (of the largest particle) beyond the faces of
/// a periodic box, at most one length of the box. A body that stays kCopyEnd kernel radii away from
/// the end of the copies does not depend on it.
inline constexpr double kCopyMargin = 6, kCopyEnd = 2;

/// The periodic box of a frame with copies. Infinite along axes without copies. World units.
struct CopiedBox {
  space::ClipBox faces;  ///< The faces of the box.
  /// Planes beyond the faces, kCopyEnd kernel radii before the end of the copies. A body within
  /// them is as if the copies had no end.
  space::ClipBox complete;
  bool any = false;  ///< Any axis has copies.
  std::array<bool, 3> has_copies{};
};

/// `radius`: the largest kernel radius, world units.
CopiedBox CopiedBoxOf(double radius, const LiftedFrame& lifted);

/// Mirror images reach kImageRadii kernel radii behind walls. So F is exact up to one radius behind
/// them, as smoothing near a wall requires. Particles up to kWallTolerance spacings behind a wall
/// count as before it. Particles closer to a wall are moved to kLeastHeight spacings before it,
/// because a particle on the wall would have no image.
inline constexpr double kImageRadii = 2, kWallTolerance = .5, kLeastHeight = .05;

/// The number of axes with walls.
std::uint64_t CountWallAxes(const SurfaceParameters& parameters);

/// Checks the walls, and that no other parameter excludes them. Errors: INVALID_ARGUMENT.
absl::Status CheckWallsOf(const SurfaceParameters& parameters);

/// The space before the walls, in world units; absent without walls.
std::optional<space::ClipBox> SpaceBeforeWalls(const SurfaceParameters& parameters);

/// The step of the inner points of flat faces (SurfaceCutInput::inner_step): two cells if the frame
/// has attributes, because they have values at points only. 0 for a simplified surface, which has
/// few points elsewhere, too.
double InnerStep(const SurfaceParameters& parameters, const Frame& frame);

/// Cuts the bodies that reach a wall. Returns false if CutSurface does.
bool CutAtWalls(const SurfaceParameters& parameters, double inner_step, PlaneCuts& scratch,
                Surface& surface);

/// Cuts the bodies of `shells` at the faces of the box. Returns false if CutSurface does.
bool CutAtBox(double spacing, double inner_step, const CopiedBox& box,
              const space::CutShells& shells, PlaneCuts& scratch, Surface& surface);

}  // namespace partiemc
