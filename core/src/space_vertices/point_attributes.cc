#include "space_vertices/point_attributes.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "attributes/plane_fit.h"
#include "base/parallel.h"
#include "base/vec3.h"
#include "space/crossings.h"
#include "space/near_particles.h"

namespace partiemc::space {
namespace {

constexpr std::size_t kPointsAtOnce = 64;

/// The brick that contains a place in cells. It exists if a kernel reaches the place (FindBricks).
BrickCoordinate BrickAt(const Vec3& place) {
  const auto along = [](double cells) {
    return static_cast<std::int32_t>(std::floor(cells / kBrickSize));
  };
  return {along(place.z), along(place.y), along(place.x)};
}

/// The particles around a place, which is in cells relative to a brick.
struct Around {
  const SpaceBins& bins;
  std::uint32_t brick;
  Vec3 place;
  double radius;  ///< The kernel radius of size 1, in cells.

  /// Calls visit(particle, w k, D, s) for each particle whose kernel reaches the place. D is the
  /// offset of the particle in kernel radii of size 1, s its own size. With own sizes, w is s^3.
  template <typename Visit>
  void ForEach(Visit visit) const {
    const auto x = static_cast<float>(place.x), y = static_cast<float>(place.y),
               z = static_cast<float>(place.z);
    const NearBox box{{x, y, z}, {x, y, z}};
    // Rounding to float moves the box by less than the margin.
    const float reach = static_cast<float>(radius) + 1e-4f;
    ForEachNearRun(bins, brick, box, reach, [&](const NearRun& run) {
      for (std::uint32_t p = run.first; p < run.last; ++p) {
        const Vec3 to{(double{bins.x[p]} + run.shift_x - place.x) / radius,
                      (double{bins.y[p]} + run.shift_y - place.y) / radius,
                      (double{bins.z[p]} + run.shift_z - place.z) / radius};
        if (bins.size.empty()) {
          const double within = 1 - to.x * to.x - to.y * to.y - to.z * to.z;
          if (within <= 0) continue;
          const double own = bins.weight.empty() ? 1 : double{bins.weight[p]};
          visit(p, own * within * within * within, to, 1.0);
        } else {
          const double size = bins.size[p], within = 1 - Dot(to, to) / (size * size);
          const double edge = size * within;
          if (within > 0) visit(p, edge * edge * edge, to, size);
        }
      }
    });
  }

  /// The mean own size, weighted by w k; 1 for equal sizes.
  double Size() const {
    if (bins.size.empty()) return 1;
    double sum = 0, weights = 0;
    ForEach([&](std::uint32_t, double weight, const Vec3&, double size) {
      sum += weight * size;
      weights += weight;
    });
    return weights > 0 ? sum / weights : 1;
  }
};

}  // namespace

void InterpolateInSpace(const Frame& frame, const SpaceBins& bins, const Scale& scale,
                        std::span<const double> points, std::vector<AttributeValues>& values) {
  ResizeValues(frame.attributes, points.size() / 3, values);
  ParallelForRanges(points.size() / 3, kPointsAtOnce, [&](std::size_t first, std::size_t last) {
    for (std::size_t point = first; point < last; ++point) {
      const Vec3 place = (1 / scale.cell_size) * Vec3At(points, point);
      const BrickCoordinate at = BrickAt(place);
      const std::uint32_t brick = bins.bricks.Find(at);
      PlaneFit fit;
      CarriedSums carried(frame.attributes);
      if (brick != kNoIndex) {
        const Around around{bins, brick, place - OriginOf(at), scale.kernel_radius};
        // Offsets in local sizes keep the fit well conditioned.
        const double unit = 1 / around.Size();
        around.ForEach([&](std::uint32_t p, double weight, const Vec3& to, double) {
          if (bins.IsMirror(p)) return;
          const Vec3 scaled = unit * to;
          fit.Add(weight, scaled.x, scaled.y, scaled.z);
          carried.Add(frame.attributes, bins.source[p], weight, scaled.x, scaled.y, scaled.z);
        });
      }
      carried.Evaluate(fit, point, values);
    }
  });
}

}  // namespace partiemc::space
