#include "surface_frame.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "frame/wall_rules.h"
#include "partiemc/status.h"
#include "periodic/frame_box.h"

namespace partiemc {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Each particle has mirror images within the kernel radius of the largest particle and its own one.
// So F is exact up to the first of these behind a wall, as smoothing near a wall requires.
// Particles up to kWallTolerance sizes behind a wall count as before it. Particles closer to a wall
// are moved to kLeastHeight sizes before it, because a particle on the wall would have no image.
constexpr double kWallTolerance = .5, kLeastHeight = .05;

// `radius`: the largest kernel radius, world units.
CopiedBox CopiedBoxOf(double radius, const LiftedFrame& lifted) {
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

space::ClipBox SpaceBefore(std::span<const WallPlane> walls) {
  const FluidBox box = FluidBoxOf(walls);
  return {{box.low[0], box.low[1], box.low[2]}, {box.high[0], box.high[1], box.high[2]}};
}

space::ClipBox Intersection(const space::ClipBox& a, const space::ClipBox& b) {
  return {Upper(a.low, b.low), Lower(a.high, b.high)};
}

// The walls of the stream are checked for particles of the spacing.
absl::Status CheckWallsForLargest(const SurfaceFrameInput& input) {
  const SurfaceParameters& parameters = input.parameters;
  absl::Status status = CheckWallPlanes(
      parameters.wall_planes, parameters.kernel_radius * input.sizes.Reach(), parameters.spacing);
  if (status.ok()) return status;
  Violation violation = *FindViolation(status);
  violation.rule += ", for the largest particle";
  return ViolationError(status.code(), std::move(violation));
}

}  // namespace

absl::Status AddImages(const SurfaceFrameInput& input, SurfaceFrameScratch& s, SurfaceFrame& to) {
  const SurfaceParameters& parameters = input.parameters;
  const double h = parameters.spacing;
  const double radius = parameters.kernel_radius * h * input.sizes.Reach();
  const bool has_walls = !parameters.wall_planes.empty(), has_box = input.given.box.has_value();
  const bool has_own_sizes = parameters.sizes == Sizes::kOwn;
  to = {};
  to.lifted = {.frame = input.given, .particles = input.given.ParticleCount()};
  to.first_mirror = to.lifted.particles;

  std::uint64_t reserved = 0, step = 0;
  const auto reserve = [&](std::uint64_t bytes) {
    step = bytes;
    return input.reserve(reserved + bytes);
  };
  // Particles behind walls have no effect, and those on walls move before them. With `depth` above
  // 0 there are mirror images, too.
  const auto mirror = [&](double depth, WallImageScratch& scratch, std::size_t& particles) {
    const Frame before = to.lifted.frame;
    const double unit = has_own_sizes ? 1 : h;
    absl::Status status =
        AddWallImages({.frame = before,
                       .planes = parameters.wall_planes,
                       .depth = has_own_sizes ? depth : 2 * depth,
                       .kernel_radius = has_own_sizes ? parameters.kernel_radius : 0,
                       .tolerance = kWallTolerance * unit,
                       .nearest = kLeastHeight * unit,
                       .reserve = reserve},
                      scratch, to.lifted.frame, particles);
    reserved += std::exchange(step, 0);
    return status;
  };
  if (has_walls) {
    absl::Status status = CheckWallsForLargest(input);
    if (!status.ok()) return status;
    to.before_walls = SpaceBefore(parameters.wall_planes);
  }
  if (has_box) {
    absl::Status status =
        CheckBoxLengths(parameters.box, *input.given.box, parameters.kernel_radius, h, input.sizes);
    if (status.ok() && has_walls) {
      // Walls are parallel to the periodic axes, so particles and copies are before the same walls.
      status = mirror(0, s.before_walls, to.lifted.particles);
    }
    if (!status.ok() || to.lifted.particles == 0) return status;
    constexpr std::array kAxes = {0, 1, 2};
    const Frame before = to.lifted.frame;
    const auto names = has_walls ? std::span<const std::uint32_t>(s.before_walls.originals)
                                 : std::span<const std::uint32_t>();
    status = Lift({.frame = before,
                   .box = *before.box,
                   .names = names,
                   .axes = kAxes,
                   .range = 2 * radius,
                   .margin = kCopyMargin * radius,
                   .wraps = before.box->wraps,
                   .reserve = reserve},
                  s.lift, to.lifted);
    if (!status.ok()) return status;
    reserved += std::exchange(step, 0);
    to.copied = CopiedBoxOf(radius, to.lifted);
    to.first_mirror = to.lifted.frame.ParticleCount();
    to.names = {.originals = to.lifted.originals, .first = to.lifted.particles};
  }
  if (has_walls) {
    absl::Status status = mirror(radius, s.images, to.first_mirror);
    if (!status.ok()) return status;
    if (has_box) {
      for (std::uint32_t& original : s.images.originals) {
        original = s.before_walls.originals[to.lifted.OriginalOf(original)];
      }
    } else {
      to.lifted.particles = to.first_mirror;
    }
    to.names = {.originals = s.images.originals};
  }
  if (to.copied.any) {
    to.in_box = has_walls ? Intersection(to.copied.faces, *to.before_walls) : to.copied.faces;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
