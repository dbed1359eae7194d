// Particles in periodic boxes.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "partiemc/partiemc.h"
#include "partiemc/validate.h"
#include "support/particles.h"
#include "vertices/measure.h"

namespace partiemc {

/// A box with periodic axes x and y.
inline PeriodicBox BoxOf(double length_x, double length_y, double x = 0, double y = 0) {
  return {.axes = {PeriodicAxis{x, length_x}, PeriodicAxis{y, length_y}, std::nullopt}};
}

inline ReconstructionParameters In(const PeriodicBox& box, Fill fill = Fill::kGreedy,
                                   Placement placement = Placement::kVirtualPlane) {
  return {.placement = placement, .fill = fill, .spacing = 1.0, .box = box};
}

/// Moves particles into the box, as simulators do.
inline support::Particles Wrapped(support::Particles particles, const PeriodicBox& box) {
  for (std::size_t k = 0; k < particles.xy.size(); ++k) {
    const auto& axis = box.axes[k % 2];
    if (!axis) continue;
    double& at = particles.xy[k];
    at -= axis->length * std::floor((at - axis->origin) / axis->length);
  }
  return particles;
}

/// Checks the guarantees of a result whose rings may be cut.
inline void ExpectValid(const Result& result, Fill fill) {
  const absl::Status valid = Validate(result, fill);
  EXPECT_TRUE(valid.ok()) << valid;
  EXPECT_TRUE(std::ranges::is_sorted(result.rings.cuts));
  for (std::size_t ring = 0; ring < result.rings.RingCount(); ++ring) {
    const auto points = result.rings.RingPoints(ring);
    EXPECT_LE(result.rings.measures[ring].perimeter, MeasureRing(points).perimeter + 1e-9);
  }
}

/// Particles of all rings.
inline std::uint64_t ParticlesOf(const Rings& rings) {
  std::uint64_t count = 0;
  for (const RingMeasures& ring : rings.measures) count += ring.particle_count;
  return count;
}

}  // namespace partiemc
