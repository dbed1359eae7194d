#include "plane_estimates.h"

#include <algorithm>
#include <array>

namespace partiemc {
namespace {

// Particles that support a plane, in spacings: in a disc around the vertex, near it along the
// plane, not beyond the plane, and with a weight that falls from the plane to twice the spacing
// below it.
constexpr double kSupportRadius = 2.5;
constexpr double kSupportHalfWidth = 2;
constexpr double kSupportDepth = 2;

// The strip below a plane whose volume is weighed, in spacings: wide enough to average over the
// particles' arrangement, and so deep that its lower edge, which fades out, cuts no row of them.
constexpr double kStripHalfWidth = 1.5;
constexpr double kStripDepth = 2.5;
constexpr double kStripRadius = 2.92;  // Of its corners: sqrt(1.5^2 + 2.5^2), rounded up.

// Particles farther outside than this are others', in spacings.
constexpr double kHeight = 1.2;

constexpr double kMaxEstimate = 0.8;  // Spacings.

// B(d, s) integrates to this times s on either side.
constexpr double kHalfBump = 8.0 / 15;

}  // namespace

PlaneEstimator::PlaneEstimator(const PointField& field, const Scale& scale)
    : field_(field), scale_(scale) {
  const double h = scale.spacing;
  support_ = {.radius = std::min(kSupportRadius * h, scale.kernel_radius),
              .half_width = kSupportHalfWidth * h,
              .height = kHeight * h,
              .spacing = h,
              .depth = kSupportDepth};
  // Particles are listed within the kernel radius: below a smaller one, the strip shrinks.
  const double unit = std::min(h, scale.kernel_radius / kStripRadius);
  strip_ = {.radius = kStripRadius * unit,
            .half_width = kStripHalfWidth * unit,
            .height = kHeight * h,
            .depth = kStripDepth * unit};
}

PlaneEstimates PlaneEstimator::EstimatesOf(const SupportSums& sums) const {
  const double h = scale_.spacing;
  const auto limited = [h](double shift) {
    return std::clamp(shift, -kMaxEstimate * h, kMaxEstimate * h);
  };
  if (sums.weight <= 0) return {};
  const double volume =
      field_.HasWeights() ? sums.volume / scale_.weight_per_volume : sums.volume * h * h;
  // A plane that moves out by a length has so much more volume below it.
  const double width = 2 * kHalfBump * strip_.half_width;
  return {.support = limited(sums.distance / sums.weight + h / 2),
          .strip = limited(volume / width - kHalfBump * strip_.depth)};
}

void PlaneEstimator::Estimate(std::span<const Planes> groups,
                              std::span<Estimates> estimates) const {
  const double radius = std::max(support_.radius, strip_.radius);
  std::array<SupportQuery, kQueriesAtOnce> queries;
  for (std::size_t q = 0; q < groups.size(); ++q) {
    queries[q].planes = std::span(groups[q].points).first(groups[q].count);
    field_.FindNear(groups[q].tile, queries[q].planes, radius, queries[q].near);
  }
  std::array<QuerySupports, kQueriesAtOnce> sums;
  SumSupports(std::span(queries).first(groups.size()), support_, strip_, sums);
  for (std::size_t q = 0; q < groups.size(); ++q) {
    for (std::size_t k = 0; k < groups[q].count; ++k) estimates[q][k] = EstimatesOf(sums[q][k]);
  }
}

}  // namespace partiemc
