// The periodic box of a frame, and the motion of positions with a box that changes between frames
// (core/PERIODIC.md, "Boxes that change").
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "absl/status/status.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

inline constexpr std::array<const char*, 3> kAxisNames = {"x", "y", "z"};

/// Sets Frame::box to the box that the stages use: the box of the frame with `wraps` of the
/// stream's box, or the box of the stream if the frame has none. Errors, only if the frame has a
/// box: INVALID_ARGUMENT (OUT_OF_RANGE) if the stream has no box, if the two boxes have different
/// periodic axes, or if Validate refuses an axis.
absl::Status ResolveBox(const std::optional<PeriodicBox>& of_stream, Frame& frame);

/// Checks the lengths of the box of a frame after ResolveBox. A length must be at least four kernel
/// radii, of the largest particle if sizes differ. `kernel_radius` is in spacings, `spacing` in
/// world units. Errors: as Validate; they name `parameters.box` if `box` is the box of the stream,
/// else `box`.
absl::Status CheckBoxLengths(const std::optional<PeriodicBox>& of_stream, const PeriodicBox& box,
                             double kernel_radius, double spacing, const SizeRange& sizes = {});

/// The box that a history stores: absent if `box` is absent or the box of the stream. `box`: the
/// box of the frame after ResolveBox.
std::optional<PeriodicBox> BoxToStore(const std::optional<PeriodicBox>& of_stream,
                                      const std::optional<PeriodicBox>& box);

/// The affine motion of positions with the box, from the last frame to this one.
struct BoxMotion {
  struct Axis {
    double before = 0, now = 0;  ///< Origin of the box, in the unit of MotionOf.
    double stretch = 1;          ///< Length of the box now, divided by its former length.
  };
  std::array<Axis, 3> axes;
  bool any = false;  ///< The box has changed.

  /// Moves a position along one axis.
  double At(std::size_t axis, double position) const {
    const auto& [before, now, stretch] = axes[axis];
    return now + (position - before) * stretch;
  }

  /// Moves a node, rounds to the nearest node and clamps to 32 bits. Requires: MotionOf was called
  /// with the cell size as `unit`.
  std::int32_t NodeAt(std::size_t axis, double node) const {
    constexpr double kMost = std::numeric_limits<std::int32_t>::max();
    const double at = std::floor(At(axis, node) + .5);
    return static_cast<std::int32_t>(at > -kMost ? std::min(at, kMost) : -kMost);
  }

  /// Moves the run of nodes [first, last] with its middle node; the length of the run stays.
  /// Requires: as NodeAt.
  void MoveRun(std::size_t axis, std::int32_t& first, std::int32_t& last) const {
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    const std::int64_t nodes = std::int64_t{last} - first;
    const std::int64_t middle = first + nodes / 2;
    const std::int64_t moved = NodeAt(axis, static_cast<double>(middle)) - nodes / 2;
    first = static_cast<std::int32_t>(std::clamp(moved, -kMost, kMost));
    last = static_cast<std::int32_t>(std::clamp(moved + nodes, -kMost, kMost));
  }
};

/// The motion from the box of a history to the box of a frame. `before` is absent for the box of
/// the stream; `now` is absent without a box. An axis that only one of the boxes has does not move.
/// Divides lengths by `unit`, so that positions are in this unit.
BoxMotion MotionOf(const std::optional<PeriodicBox>& of_stream,
                   const std::optional<PeriodicBox>& before, const std::optional<PeriodicBox>& now,
                   double unit);

}  // namespace partiemc
