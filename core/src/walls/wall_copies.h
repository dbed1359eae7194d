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

/// The range around particles and their copies. `margin`: beyond the outermost ones. Without
/// particles, an empty range: `low` above `high`.
WallRange RangeAround(const Frame& frame, Plane plane, double margin);

class WallCopies {
 public:
  /// Sets walls() to the endless lines, which have no images, and the images of obstacles that
  /// overlap the range. Errors: INVALID_ARGUMENT (OUT_OF_RANGE) if obstacles and images have more
  /// than kMostPoints points. Cost: linear in the points.
  absl::Status TakeObstacles(std::span<const Wall> walls, const WallRange& range);

  /// Sets particles() to the wall particles and images in the range. Errors: INVALID_ARGUMENT
  /// (TOO_MANY_PARTICLES) for more than FrameLimits::kMostParticles; errors of `reserve`, which is
  /// called with the bytes before they are allocated. Requires: CheckFrame has passed the frame.
  /// Cost: linear in particles and images.
  absl::Status TakeParticles(const Frame& frame, Plane plane, const WallRange& range,
                             absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve);

  /// Views of this object.
  std::span<const Wall> walls() const { return std::span(walls_).first(wall_count_); }
  const Frame& particles() const { return particles_; }

  static constexpr std::uint64_t kMostPoints = 1 << 20;

 private:
  std::vector<Wall> walls_;  // The first wall_count_ are of this frame.
  std::size_t wall_count_ = 0;
  std::vector<double> positions_;
  std::vector<float> volumes_;
  Frame particles_;
};

}  // namespace partiemc
