#include "periodic_outline.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "bins/resolution.h"
#include "frame/frame_view.h"

namespace partiemc {
namespace {

// Copies of percolating bodies reach this many kernel radii beyond the box, at most one length. Two
// radii inside this margin, an outline does not depend on where the copies end: smoothing uses the
// outline less than a radius away.
constexpr double kCopyMargin = 6, kCopyEnd = 2;

std::array<std::size_t, 2> AxesInPlane(const Frame& frame, Plane plane) {
  const Axes axes = AxesOf(frame, plane);
  return {static_cast<std::size_t>(axes.first), static_cast<std::size_t>(axes.second)};
}

}  // namespace

absl::Status LiftOutline(const ReconstructionParameters& parameters, const Frame& given,
                         absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve,
                         LiftScratch& scratch, PeriodicFrame& periodic) {
  periodic.lifted = {.frame = given, .particles = given.ParticleCount()};
  if (!periodic.lengths) return absl::OkStatus();
  const double spacing = periodic.lengths->spacing;
  absl::Status status = CheckStep(given, parameters.plane, spacing, periodic.doubts);
  if (!status.ok() && !periodic.lengths->is_provisional) return status;
  status = Validate(*parameters.box, parameters.kernel_radius, spacing);
  if (!status.ok()) return status;
  const double radius = parameters.kernel_radius * spacing;
  // Rings that may cross themselves cannot be cut.
  double margin = KeepsGuarantees(parameters.placement) ? kCopyMargin * radius : 0;
  for (const auto& axis : parameters.box->axes) {
    if (axis) margin = std::min(margin, axis->length);
  }
  const auto in_plane = AxesInPlane(given, parameters.plane);
  const std::array<int, 2> axes{static_cast<int>(in_plane[0]), static_cast<int>(in_plane[1])};
  status = Lift({.frame = given,
                 .box = *parameters.box,
                 .axes = axes,
                 .range = 2 * radius,
                 .margin = margin,
                 .wraps = parameters.box->wraps,
                 .reserve = reserve},
                scratch, periodic.lifted);
  periodic.reach = margin - kCopyEnd * radius;
  for (std::size_t k = 0; k < in_plane.size(); ++k) {
    if (!periodic.lifted.percolates[in_plane[k]]) continue;
    periodic.window.axes[k] = parameters.box->axes[in_plane[k]];
  }
  return status;
}

LatticePeriods PeriodsOf(const ReconstructionParameters& parameters, const Frame& frame,
                         double cell_size) {
  LatticePeriods periods;
  if (!parameters.box) return periods;
  const auto in_plane = AxesInPlane(frame, parameters.plane);
  for (std::size_t k = 0; k < in_plane.size(); ++k) {
    const auto& axis = parameters.box->axes[in_plane[k]];
    if (axis) periods.cells[k] = axis->length / cell_size;
  }
  return periods;
}

}  // namespace partiemc
