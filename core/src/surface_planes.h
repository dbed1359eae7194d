// Surfaces that end at planes: walls, and the faces of a periodic box.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/surface.h"
#include "partiemc/surface_reconstructor.h"
#include "space_cut/surface_cut.h"
#include "space_images/body_images.h"
#include "surface_frame.h"

namespace partiemc {

/// Warm buffers of CutAtWalls and CutAtBox.
struct PlaneCuts {
  std::vector<space::AxisPlane> planes;
  std::vector<std::uint8_t> is_cut;   // By shell.
  std::vector<std::uint8_t> is_done;  // By shell: CutAtBox has cut it. Empty without a box.
  space::SurfaceCutScratch cut;
  space::SurfacePieces pieces;
};

/// The number of axes with walls.
std::uint64_t CountWallAxes(const SurfaceParameters& parameters);

/// Checks the walls, and that no other parameter excludes them. Errors: INVALID_ARGUMENT.
absl::Status CheckWallsOf(const SurfaceParameters& parameters);

/// The step of the inner points of flat faces (SurfaceCutInput::inner_step): two cells if the frame
/// has attributes, because they have values at points only. 0 for a simplified surface, which has
/// few points elsewhere, too.
double InnerStep(const SurfaceParameters& parameters, const Frame& frame);

/// Cuts the bodies of `shells` at the faces of the box and at the walls. Returns false if
/// CutSurface does.
bool CutAtBox(const SurfaceParameters& parameters, double inner_step, const CopiedBox& box,
              const space::CutShells& shells, PlaneCuts& scratch, Surface& surface);

/// Cuts the other bodies that reach a wall. `scratch.is_done`: as CutAtBox leaves it. Returns false
/// if CutSurface does.
bool CutAtWalls(const SurfaceParameters& parameters, double inner_step, PlaneCuts& scratch,
                Surface& surface);

}  // namespace partiemc
