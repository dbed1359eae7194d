#include "vertices/plane_estimates.h"

#include <algorithm>
#include <span>

namespace partiemc {

PlaneEstimator::PlaneEstimator(const LevelSetSampler& field, const Scale& scale,
                               const VirtualPlaneConstants& constants)
    : field_(field),
      spacing_(scale.spacing),
      // Particles are listed within the kernel radius.
      support_{.radius = std::min(constants.support_radius * scale.spacing, scale.kernel_radius),
               .height = constants.support_height * scale.spacing,
               .spacing = scale.spacing,
               .depth = constants.support_depth} {}

PlaneEstimate PlaneEstimator::EstimateOf(const SupportSums& sums) const {
  if (!(sums.weight > 0)) return {};
  const double mean = sums.distance / sums.weight;
  const double variance = std::max(0.0, sums.square / sums.weight - mean * mean);
  return {.offset = std::clamp(mean + spacing_ / 2, -support_.height, support_.height),
          .scatter = variance / (spacing_ * spacing_)};
}

void PlaneEstimator::Estimate(const Planes& group, Estimates& estimates) const {
  SupportQuery query;
  query.planes = std::span(group.points).first(group.count);
  field_.FindNear(group.tile, query.planes, support_.radius, query.near);
  QuerySupports sums;
  SumSupports(query, support_, sums);
  for (std::size_t k = 0; k < group.count; ++k) estimates[k] = EstimateOf(sums[k]);
}

}  // namespace partiemc
