#include "surface_planes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "frame/wall_rules.h"
#include "partiemc/status.h"
#include "walls/wall_images.h"

namespace partiemc {
namespace {

void AddWalls(const SurfaceParameters& parameters, std::vector<space::AxisPlane>& planes) {
  for (const WallPlane& wall : parameters.wall_planes) {
    planes.push_back({wall.axis, wall.position, wall.is_fluid_above, /*is_wall=*/true});
  }
}

}  // namespace

std::uint64_t CountWallAxes(const SurfaceParameters& parameters) {
  std::array<bool, 3> has_wall{};
  for (const WallPlane& plane : parameters.wall_planes) {
    has_wall[static_cast<std::size_t>(plane.axis)] = true;
  }
  return static_cast<std::uint64_t>(std::ranges::count(has_wall, true));
}

absl::Status CheckWallsOf(const SurfaceParameters& parameters) {
  const std::vector<WallPlane>& planes = parameters.wall_planes;
  if (planes.empty()) return absl::OkStatus();
  absl::Status status = CheckWallPlanes(planes, parameters.kernel_radius, parameters.spacing);
  return status.ok() ? CheckAxesOfWalls(planes, parameters.box) : status;
}

double InnerStep(const SurfaceParameters& parameters, const Frame& frame) {
  const bool has_inner = !frame.attributes.empty() && !(parameters.simplify > 0);
  return has_inner ? 2 * parameters.cell_size * parameters.spacing : 0;
}

bool CutAtBox(const SurfaceParameters& parameters, double inner_step, const CopiedBox& box,
              const space::CutShells& shells, PlaneCuts& scratch, Surface& surface) {
  scratch.is_done.clear();
  if (!shells.any) return true;
  const std::array<double, 3> low{box.faces.low.x, box.faces.low.y, box.faces.low.z};
  const std::array<double, 3> high{box.faces.high.x, box.faces.high.y, box.faces.high.z};
  scratch.planes.clear();
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (!box.has_copies[k]) continue;
    scratch.planes.push_back({axis, low[k], true});
    scratch.planes.push_back({axis, high[k], false});
  }
  AddWalls(parameters, scratch.planes);
  const bool is_cut = space::CutSurface({.planes = scratch.planes,
                                         .is_cut = shells.is_cut,
                                         .body_of = shells.outer_of,
                                         .spacing = parameters.spacing,
                                         .inner_step = inner_step},
                                        scratch.cut, scratch.pieces, surface);
  if (!is_cut) return false;
  for (const std::uint32_t source : scratch.pieces.sources) {
    scratch.is_done.push_back(shells.is_cut[source]);
  }
  return true;
}

bool CutAtWalls(const SurfaceParameters& parameters, double inner_step, PlaneCuts& scratch,
                Surface& surface) {
  // More than CutSurface moves a plane, so that no other shell reaches a moved plane.
  constexpr double kReach = 1e-4;
  scratch.planes.clear();
  AddWalls(parameters, scratch.planes);
  scratch.is_cut.assign(surface.ShellCount(), 0);
  bool any = false;
  const auto is_done = [&](std::size_t shell) {
    return !scratch.is_done.empty() && scratch.is_done[shell] != 0;
  };
  for (const WallPlane& plane : parameters.wall_planes) {
    const double sign = plane.is_fluid_above ? 1 : -1;
    const double reach = kReach * parameters.spacing + 1e-5 * kReach * std::abs(plane.position);
    for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
      if (scratch.is_cut[shell] != 0 || is_done(shell)) continue;
      for (std::size_t p = surface.point_offsets[shell]; p < surface.point_offsets[shell + 1];
           ++p) {
        const double at = surface.points[3 * p + static_cast<std::size_t>(plane.axis)];
        if (sign * (at - plane.position) > reach) continue;
        scratch.is_cut[shell] = 1;
        any = true;
        break;
      }
    }
  }
  if (!any) return true;
  // A body and its cavities are cut together.
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
      const std::uint32_t outer = surface.outer_of[shell];
      if (outer == kNoShell) continue;
      if (pass == 0 ? scratch.is_cut[shell] != 0 : scratch.is_cut[outer] != 0) {
        scratch.is_cut[shell] = scratch.is_cut[outer] = 1;
      }
    }
  }
  return space::CutSurface({.planes = scratch.planes,
                            .is_cut = scratch.is_cut,
                            .spacing = parameters.spacing,
                            .inner_step = inner_step},
                           scratch.cut, scratch.pieces, surface);
}

}  // namespace partiemc
