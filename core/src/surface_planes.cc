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

CopiedBox CopiedBoxOf(double radius, const LiftedFrame& lifted) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CopiedBox box;
  box.has_copies = lifted.percolates;
  std::array<double, 3> low, high, least, most;
  low.fill(-kInfinity), least.fill(-kInfinity);
  high.fill(kInfinity), most.fill(kInfinity);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!lifted.percolates[k]) continue;
    box.any = true;
    const PeriodicAxis& axis = *lifted.frame.box->axes[k];
    const double reach = std::min(kCopyMargin * radius, axis.length) - kCopyEnd * radius;
    low[k] = axis.origin, high[k] = axis.origin + axis.length;
    least[k] = low[k] - reach, most[k] = high[k] + reach;
  }
  box.faces = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  box.complete = {{least[0], least[1], least[2]}, {most[0], most[1], most[2]}};
  return box;
}

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
  const char* rule = nullptr;
  if (parameters.box) rule = "must be absent with a periodic box";
  if (parameters.sizes == Sizes::kOwn) rule = "must be absent unless sizes are equal";
  if (rule != nullptr) {
    return ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(kReasonOutOfRange), "parameters.wall_planes", "present", rule});
  }
  return CheckWallPlanes(planes, parameters.kernel_radius, parameters.spacing);
}

std::optional<space::ClipBox> SpaceBeforeWalls(const SurfaceParameters& parameters) {
  if (parameters.wall_planes.empty()) return std::nullopt;
  const FluidBox box = FluidBoxOf(parameters.wall_planes);
  return space::ClipBox{{box.low[0], box.low[1], box.low[2]},
                        {box.high[0], box.high[1], box.high[2]}};
}

double InnerStep(const SurfaceParameters& parameters, const Frame& frame) {
  const bool has_inner = !frame.attributes.empty() && !(parameters.simplify > 0);
  return has_inner ? 2 * parameters.cell_size * parameters.spacing : 0;
}

bool CutAtWalls(const SurfaceParameters& parameters, double inner_step, PlaneCuts& scratch,
                Surface& surface) {
  // More than CutSurface moves a plane, so that no other shell reaches a moved plane.
  constexpr double kReach = 1e-4;
  scratch.planes.clear();
  scratch.is_cut.assign(surface.ShellCount(), 0);
  bool any = false;
  for (const WallPlane& plane : parameters.wall_planes) {
    scratch.planes.push_back({plane.axis, plane.position, plane.is_fluid_above});
    const double sign = plane.is_fluid_above ? 1 : -1;
    const double reach = kReach * parameters.spacing + 1e-5 * kReach * std::abs(plane.position);
    for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
      if (scratch.is_cut[shell] != 0) continue;
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
                            .inner_step = inner_step,
                            .are_walls = true},
                           scratch.cut, scratch.pieces, surface);
}

bool CutAtBox(double spacing, double inner_step, const CopiedBox& box,
              const space::CutShells& shells, PlaneCuts& scratch, Surface& surface) {
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
  return space::CutSurface({.planes = scratch.planes,
                            .is_cut = shells.is_cut,
                            .body_of = shells.outer_of,
                            .spacing = spacing,
                            .inner_step = inner_step},
                           scratch.cut, scratch.pieces, surface);
}

}  // namespace partiemc
