// Reads the numbers of a frame and checks them.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "base/point.h"
#include "base/prefetch.h"
#include "frame/distinct_ids.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Reads the coordinate pairs of a frame with numbers of type Real.
template <typename Real>
class PositionReader {
 public:
  /// Requires: `first`, `second` < `components`. `values` may be null if there are no particles.
  PositionReader(const Real* values, int components, int first, int second)
      : first_(values == nullptr ? nullptr : values + first),
        second_(values == nullptr ? nullptr : values + second),
        components_(components) {}

  Point operator[](std::size_t particle) const {
    const std::size_t at = particle * components_;
    return {static_cast<double>(first_[at]), static_cast<double>(second_[at])};
  }

  /// The interleaved pairs of `count` particles from `first` on: a view of the frame if it has two
  /// components, else copied to `copy`, which must have space for them.
  std::span<const Real> Pairs(std::size_t first, std::size_t count, Real* copy) const {
    if (components_ == 2) return {first_ + 2 * first, 2 * count};
    for (std::size_t k = 0; k < count; ++k) {
      copy[2 * k] = first_[(first + k) * components_];
      copy[2 * k + 1] = second_[(first + k) * components_];
    }
    return {copy, 2 * count};
  }

  /// Prefetches the numbers of `count` particles from `first` on.
  void Prefetch(std::size_t first, std::size_t count) const {
    PrefetchLines(std::span(first_ + first * components_, count * components_));
  }

  using Number = Real;

 private:
  const Real* first_;
  const Real* second_;
  std::size_t components_;
};

/// The axes that span a plane, and its normal axis: 0, 1, 2 for x, y, z.
struct Axes {
  int first, second, normal;
};
Axes AxesOf(Plane plane);

/// The axes for a frame; frames with two components have x and y.
inline Axes AxesOf(const Frame& frame, Plane plane) {
  return AxesOf(frame.components == 3 ? plane : Plane::kXy);
}

/// Calls visit(reader) with the PositionReader of a frame, so that the number type is resolved once
/// for all particles. Requires: CheckFrame has passed the frame.
template <typename Visit>
auto VisitPositions(const Frame& frame, Plane plane, Visit visit) {
  const Axes axes = AxesOf(frame, plane);
  return std::visit(
      [&](auto view) {
        return visit(PositionReader(view.data(), frame.components, axes.first, axes.second));
      },
      frame.positions);
}

Point PositionOf(const Frame& frame, Plane plane, std::size_t particle);

/// A velocity in the plane. Requires: the frame has velocities.
struct PlaneVelocity {
  float x, y;
};
PlaneVelocity VelocityOf(const Frame& frame, Plane plane, std::size_t particle);

/// The name of a coordinate for a Violation: "positions[17].x".
std::string CoordinateField(std::string_view array, std::size_t particle, int axis);

/// Makes an INVALID_ARGUMENT status with a Violation about one field of the frame.
absl::Status InvalidFrame(std::string_view reason, std::string field, std::string value,
                          std::string rule);

/// The same for a parameter that is out of range. `field`: its path without "parameters.".
absl::Status InvalidParameter(std::string_view field, std::string value, std::string_view rule);
absl::Status InvalidParameter(std::string_view field, double value, std::string_view rule);

/// The largest coordinate, in world units: the largest number of cells times the largest spacing.
/// Squares of distances stay finite.
inline constexpr double kMaxCoordinate = 1e69;

/// Limit of the names of attributes.
inline constexpr std::size_t kMostNameBytes = 64;

/// Checks the attributes of a frame. Errors: as CheckFrame.
absl::Status CheckAttributes(const Frame& frame);

/// Checks that every array has the right size and every number is usable: coordinates at most 1e69
/// in magnitude and, without a slice, in one plane; volumes positive, and present for Sizes::kOwn;
/// ids distinct; velocities and attributes finite.
/// `parameters.slice` must be set if particles fill space, also for a surface. Errors:
/// INVALID_ARGUMENT, RESOURCE_EXHAUSTED for too many particles. The Violation names the first
/// particle at fault. If the particles lie in no plane, the Violation names the particle with the
/// largest coordinate along the normal of the plane.
absl::Status CheckFrame(const Frame& frame, const ReconstructionParameters& parameters,
                        const FrameLimits& limits, DistinctIdsScratch& scratch);

/// Sets `phases` to the values of the attribute `name`, one whole number for each particle, and
/// `others` to the other attributes. Errors: INVALID_ARGUMENT if a frame with particles lacks the
/// attribute, or if its values are not one whole number per particle. Requires: CheckFrame has
/// passed the frame.
absl::Status TakePhaseValues(const Frame& frame, const std::string& name,
                             std::span<const float>& phases, std::vector<Attribute>& others);

}  // namespace partiemc
