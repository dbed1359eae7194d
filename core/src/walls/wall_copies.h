// The walls near the particles of a periodic box: images of obstacles, and copies of wall
// particles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "base/point.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Where walls are needed, in the plane of the particles. World units.
struct WallRange {
  std::array<std::optional<PeriodicAxis>, 2> periods;  ///< Absent: not periodic along this axis.
  Point low, high;
};

/// The range of particles and their copies. Without particles, an empty range: `low` above `high`.
WallRange RangeOf(const Frame& frame, Plane plane);

/// The range, wider by a margin on each side. World units.
WallRange Widened(WallRange range, double margin);

/// Called with bytes before they are allocated. Its error ends the call.
using ReserveBytes = absl::FunctionRef<absl::Status(std::uint64_t bytes)>;

struct WallParticleInput {
  const Frame& frame;
  Plane plane;
  std::span<const std::uint32_t> names;  ///< By particle: the caller's number of it, for errors.
};

class WallCopies {
 public:
  /// Sets walls() to the endless lines, which have no images, and the images of obstacles that
  /// overlap the range. Errors: INVALID_ARGUMENT (OUT_OF_RANGE) for an obstacle with images over
  /// more than 1e6 lengths, or if all have more than kMostPoints points; errors of `reserve`.
  /// Cost: linear in the points.
  absl::Status TakeObstacles(std::span<const Wall> walls, const WallRange& range,
                             ReserveBytes reserve);

  /// Sets particles() to the wall particles and images in the range. Errors: INVALID_ARGUMENT:
  /// OUT_OF_RANGE for a particle more than 1e6 lengths away, TOO_MANY_PARTICLES for more than
  /// FrameLimits::kMostParticles; errors of `reserve`. Requires: CheckFrame has passed the frame.
  /// Cost: linear in particles and images. Throws Cancelled as ThrowIfCancelled.
  absl::Status TakeParticles(const WallParticleInput& input, const WallRange& range,
                             ReserveBytes reserve);

  /// Views of this object.
  std::span<const Wall> walls() const { return std::span(walls_).first(wall_count_); }
  const Frame& particles() const { return particles_; }
  /// By particle of particles(): the caller's number of its original.
  std::span<const std::uint32_t> names() const { return names_; }

  static constexpr std::uint64_t kMostPoints = 1 << 16;
  /// Of the images, and of their lines in WallLines.
  static constexpr std::uint64_t kBytesPerPoint = 256;

 private:
  std::vector<Wall> walls_;  // The first wall_count_ are of this frame.
  std::size_t wall_count_ = 0;
  std::vector<double> positions_;
  std::vector<float> volumes_;
  std::vector<std::uint32_t> names_;
  Frame particles_;
};

}  // namespace partiemc
