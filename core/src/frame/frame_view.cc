#include "frame/frame_view.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>

#include "absl/strings/str_cat.h"
#include "base/parallel.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Largest distance of positions from their plane, relative to their extent in the plane. The limit
// is above the rounding noise of simulators and far below the depth of particles that fill space.
constexpr double kPlanarTolerance = 1e-5;

// Values per task: enough that the cost of a task does not matter.
constexpr std::size_t kCheckedAtOnce = 1 << 16;

constexpr char kAxes[] = "xyz";

// Whether every value is a number of at most kMaxCoordinate. The loop has no early exit, so that
// the compiler vectorises it.
template <typename Real>
bool AreCoordinates(std::span<const Real> values) {
  constexpr double kLargest = std::numeric_limits<Real>::max();
  constexpr auto kLimit = static_cast<Real>(std::min(kMaxCoordinate, kLargest));
  bool good = true;
  for (const Real value : values) good &= std::abs(value) <= kLimit;
  return good;
}

template <typename Real>
bool AreCoordinatesInParallel(std::span<const Real> values) {
  std::atomic<bool> good = true;
  ParallelForRanges(values.size(), kCheckedAtOnce, [&](std::size_t first, std::size_t last) {
    if (!AreCoordinates(values.subspan(first, last - first))) {
      good.store(false, std::memory_order_relaxed);
    }
  });
  return good;
}

absl::Status CheckCoordinate(double value, std::size_t particle, int axis) {
  if (!std::isfinite(value)) {
    return InvalidFrame(kReasonNotFinite, CoordinateField("positions", particle, axis),
                        ShortestNumber(value), "must be finite");
  }
  if (std::abs(value) > kMaxCoordinate) {
    return InvalidFrame(kReasonOutOfRange, CoordinateField("positions", particle, axis),
                        ShortestNumber(value), "must be at most 1e69 in magnitude");
  }
  return absl::OkStatus();
}

absl::Status CheckCoordinates(const Frame& frame) {
  return std::visit(
      [&](auto values) {
        if (AreCoordinatesInParallel(values)) return absl::OkStatus();
        absl::Status status;
        for (std::size_t k = 0; k < values.size() && status.ok(); ++k) {
          status = CheckCoordinate(static_cast<double>(values[k]), k / frame.components,
                                   static_cast<int>(k % frame.components));
        }
        return status;
      },
      frame.positions);
}

absl::Status CheckPlanar(const Frame& frame, Plane plane) {
  const Axes axes = AxesOf(plane);
  double low[3], high[3];
  std::fill(low, low + 3, std::numeric_limits<double>::infinity());
  std::fill(high, high + 3, -std::numeric_limits<double>::infinity());
  std::size_t farthest = 0;
  std::visit(
      [&](auto values) {
        for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
          for (int axis = 0; axis < 3; ++axis) {
            const auto value = static_cast<double>(values[3 * k + axis]);
            if (axis == axes.normal && value > high[axis]) farthest = k;
            low[axis] = std::min(low[axis], value);
            high[axis] = std::max(high[axis], value);
          }
        }
      },
      frame.positions);
  const double extent =
      std::max(high[axes.first] - low[axes.first], high[axes.second] - low[axes.second]);
  const double thickness = high[axes.normal] - low[axes.normal];
  if (thickness <= kPlanarTolerance * extent) return absl::OkStatus();
  const std::string axis(1, kAxes[axes.normal]);
  return InvalidFrame(
      kReasonNotPlanar, CoordinateField("positions", farthest, axes.normal),
      ShortestNumber(high[axes.normal]),
      absl::StrCat("particles must lie in the ", std::string(Name(plane)), " plane, but ", axis,
                   " ranges over [", ShortestNumber(low[axes.normal]), ", ",
                   ShortestNumber(high[axes.normal]), "]"));
}

// Checks that an optional array is empty or has one value per particle.
absl::Status CheckCount(const Frame& frame, std::string_view field, std::size_t values) {
  if (values == 0 || values == frame.ParticleCount()) return absl::OkStatus();
  return InvalidFrame(
      kReasonCount, std::string(field), absl::StrCat(values, " values"),
      absl::StrCat("must be empty or one per particle (", frame.ParticleCount(), ")"));
}

absl::Status CheckVolumes(const Frame& frame) {
  if (absl::Status status = CheckCount(frame, "volumes", frame.volumes.size()); !status.ok()) {
    return status;
  }
  for (std::size_t k = 0; k < frame.volumes.size(); ++k) {
    const float volume = frame.volumes[k];
    if (!(volume > 0) || !std::isfinite(volume)) {
      return InvalidFrame(std::isfinite(volume) ? kReasonOutOfRange : kReasonNotFinite,
                          absl::StrCat("volumes[", k, "]"), ShortestNumber(volume),
                          "must be positive and finite");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckIds(const Frame& frame, DistinctIdsScratch& scratch) {
  if (absl::Status status = CheckCount(frame, "ids", frame.ids.size()); !status.ok()) {
    return status;
  }
  const auto repeated = FindRepeated(frame.ids, scratch);
  if (!repeated) return absl::OkStatus();
  return InvalidFrame(kReasonDuplicate, absl::StrCat("ids[", repeated->again, "]"),
                      absl::StrCat(frame.ids[repeated->again]),
                      absl::StrCat("must be that of one particle only, but ids[", repeated->first,
                                   "] is the same; leave ids out where particles have none"));
}

absl::Status CheckVelocities(const Frame& frame) {
  if (frame.velocities.empty()) return absl::OkStatus();
  const std::size_t components = static_cast<std::size_t>(frame.components);
  if (frame.velocities.size() != components * frame.ParticleCount()) {
    return InvalidFrame(kReasonCount, "velocities",
                        absl::StrCat(frame.velocities.size(), " values"),
                        absl::StrCat("must be empty or ", components, " per particle (",
                                     frame.ParticleCount(), "), as positions are"));
  }
  for (std::size_t k = 0; k < frame.velocities.size(); ++k) {
    if (std::isfinite(frame.velocities[k])) continue;
    return InvalidFrame(
        kReasonNotFinite,
        CoordinateField("velocities", k / components, static_cast<int>(k % components)),
        ShortestNumber(frame.velocities[k]), "must be finite");
  }
  return absl::OkStatus();
}

}  // namespace

Axes AxesOf(Plane plane) {
  switch (plane) {
    case Plane::kXy:
      return {0, 1, 2};
    case Plane::kXz:
      return {0, 2, 1};
    case Plane::kYz:
      return {1, 2, 0};
  }
  return {0, 1, 2};
}

Point PositionOf(const Frame& frame, Plane plane, std::size_t particle) {
  return VisitPositions(frame, plane, [&](const auto& reader) { return reader[particle]; });
}

PlaneVelocity VelocityOf(const Frame& frame, Plane plane, std::size_t particle) {
  const Axes axes = AxesOf(frame, plane);
  const float* velocity = frame.velocities.data() + particle * frame.components;
  return {velocity[axes.first], velocity[axes.second]};
}

std::string CoordinateField(std::string_view array, std::size_t particle, int axis) {
  return absl::StrCat(std::string(array), "[", particle, "].", std::string(1, kAxes[axis]));
}

absl::Status InvalidFrame(std::string_view reason, std::string field, std::string value,
                          std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

absl::Status InvalidParameter(std::string_view field, std::string value, std::string_view rule) {
  return InvalidFrame(kReasonOutOfRange, absl::StrCat("parameters.", std::string(field)),
                      std::move(value), std::string(rule));
}

absl::Status InvalidParameter(std::string_view field, double value, std::string_view rule) {
  return InvalidParameter(field, ShortestNumber(value), rule);
}

absl::Status Validate(const FrameLimits& limits) {
  const auto check = [](std::string_view field, std::size_t value, std::size_t most) {
    if (value <= most) return absl::OkStatus();
    return InvalidFrame(kReasonOutOfRange, "limits." + std::string(field), absl::StrCat(value),
                        absl::StrCat("must be at most ", most));
  };
  if (absl::Status status =
          check("max_particles", limits.max_particles, FrameLimits::kMostParticles);
      !status.ok()) {
    return status;
  }
  return check("max_tiles", limits.max_tiles, FrameLimits::kMostTiles);
}

absl::Status CheckFrame(const Frame& frame, const ReconstructionParameters& parameters,
                        const FrameLimits& limits, DistinctIdsScratch& scratch) {
  const std::size_t values = std::visit([](auto view) { return view.size(); }, frame.positions);
  if (frame.components != 2 && frame.components != 3) {
    return InvalidFrame(kReasonOutOfRange, "components", absl::StrCat(frame.components),
                        "must be 2 or 3");
  }
  if (parameters.slice && frame.components != 3) {
    return InvalidFrame(kReasonOutOfRange, "components", absl::StrCat(frame.components),
                        "must be 3 for a slice or a surface: x, y and z");
  }
  if (values % frame.components != 0) {
    return InvalidFrame(kReasonCount, "positions", absl::StrCat(values, " values"),
                        absl::StrCat("must be ", frame.components, " per particle"));
  }
  if (frame.ParticleCount() > limits.max_particles) {
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonTooManyParticles), "positions",
         absl::StrCat(frame.ParticleCount(), " particles"),
         absl::StrCat("must be at most ", limits.max_particles, " in one frame")});
  }
  if (absl::Status status = CheckCoordinates(frame); !status.ok()) return status;
  if (frame.components == 3 && frame.ParticleCount() > 0 && !parameters.slice) {
    if (absl::Status status = CheckPlanar(frame, parameters.plane); !status.ok()) return status;
  }
  if (absl::Status status = CheckVolumes(frame); !status.ok()) return status;
  if (parameters.sizes == Sizes::kOwn && frame.volumes.empty() && frame.ParticleCount() > 0) {
    return InvalidFrame(kReasonCount, "volumes", "0 values",
                        "must be one per particle: parameters.sizes is own");
  }
  if (absl::Status status = CheckIds(frame, scratch); !status.ok()) return status;
  if (absl::Status status = CheckVelocities(frame); !status.ok()) return status;
  return CheckAttributes(frame);
}

}  // namespace partiemc
