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

/// The brick that holds a place in cells. It exists if a particle is within the kernel radius
/// (FindBricks).
BrickCoordinate BrickAt(const Vec3& place) {
  const auto along = [](double cells) {
    return static_cast<std::int32_t>(std::floor(cells / kBrickSize));
  };
  return {along(place.z), along(place.y), along(place.x)};
}

/// Adds the particles within `radius` cells of a place relative to `brick`.
void AddParticlesAround(const Frame& frame, const SpaceBins& bins, std::uint32_t brick,
                        const Vec3& place, double radius, PlaneFit& fit, CarriedSums& carried) {
  const auto x = static_cast<float>(place.x), y = static_cast<float>(place.y),
             z = static_cast<float>(place.z);
  const NearBox box{{x, y, z}, {x, y, z}};
  // Rounding to float moves the box by less than the margin.
  const float reach = static_cast<float>(radius) + 1e-4f;
  ForEachNearRun(bins, brick, box, reach, [&](const NearRun& run) {
    for (std::uint32_t p = run.first; p < run.last; ++p) {
      const double dx = (double{bins.x[p]} + run.shift_x - place.x) / radius;
      const double dy = (double{bins.y[p]} + run.shift_y - place.y) / radius;
      const double dz = (double{bins.z[p]} + run.shift_z - place.z) / radius;
      const double within = 1 - dx * dx - dy * dy - dz * dz;
      if (within <= 0) continue;
      const double own = bins.weight.empty() ? 1 : double{bins.weight[p]};
      const double weight = own * within * within * within;
      fit.Add(weight, dx, dy, dz);
      carried.Add(frame.attributes, bins.source[p], weight, dx, dy, dz);
    }
  });
}

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
        AddParticlesAround(frame, bins, brick, place - OriginOf(at), scale.kernel_radius, fit,
                           carried);
      }
      carried.Evaluate(fit, point, values);
    }
  });
}

}  // namespace partiemc::space
