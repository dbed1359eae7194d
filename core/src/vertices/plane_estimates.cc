#include "vertices/plane_estimates.h"

#include <algorithm>
#include <array>

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

void PlaneEstimator::Estimate(std::span<const Planes> groups,
                              std::span<Estimates> estimates) const {
  std::array<SupportQuery, kQueriesAtOnce> queries;
  for (std::size_t q = 0; q < groups.size(); ++q) {
    queries[q].planes = std::span(groups[q].points).first(groups[q].count);
    field_.FindNear(groups[q].tile, queries[q].planes, support_.radius, queries[q].near);
  }
  std::array<QuerySupports, kQueriesAtOnce> sums;
  SumSupports(std::span(queries).first(groups.size()), support_, sums);
  for (std::size_t q = 0; q < groups.size(); ++q) {
    for (std::size_t k = 0; k < groups[q].count; ++k) estimates[q][k] = EstimateOf(sums[q][k]);
  }
}

}  // namespace partiemc
