#include "area.h"

#include <algorithm>
#include <cmath>

#include "measure.h"
#include "parallel.h"
#include "ring_offset.h"

namespace partiemc {
namespace {

// Smaller components are spray: their volume says more about how they broke off than about where
// the outline of the rest should be.
constexpr std::uint64_t kMinPooledParticles = 30;

// Volumes of recordings are 1-4 % off: more than this is not theirs to decide. In spacings. A
// larger one leaves less area behind on the tuning set, and costs the drum's calm.
constexpr double kMaxOffset = 0.15;
// Frames whose wish is beyond the first number are believed less, beyond the second not at all. In
// spacings.
constexpr double kFadeFrom = 0.8;
constexpr double kFadeTo = 1.6;

// Share of the difference to the wish that a frame makes good. Each tenth less leaves more of the
// area behind, each tenth more costs calm where bodies merge (core/METHOD.md, "The default
// placement", 7).
constexpr double kFollow = 0.9;

double Smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Sum of the volumes of an outer ring's particles, in cells.
double VolumeOf(const VertexInput& input, std::size_t ring) {
  if (input.frame.volumes.empty()) {
    const double each = input.scale.spacing * input.scale.spacing;
    return static_cast<double>(input.topology.particle_count[ring]) * each;
  }
  return input.topology.particle_weight[ring] / input.scale.weight_per_volume;
}

// What a frame alone would ask for.
struct Wish {
  double offset;  // In spacings.
  double trust;   // From 0, not believed, to 1.
};

// Nothing without large components.
std::optional<Wish> WishOf(const VertexInput& input, const Rings& rings, double spacing) {
  const double cell_area = input.scale.cell_size * input.scale.cell_size;
  double volume = 0, area = 0, perimeter = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    const std::size_t outer = is_outer ? ring : rings.outer_of[ring];
    if (input.topology.particle_count[outer] < kMinPooledParticles) continue;
    if (is_outer) volume += VolumeOf(input, ring) * cell_area;
    const RingMeasures measures = MeasureRing(rings.RingPoints(ring));
    area += measures.area;
    perimeter += measures.perimeter;
  }
  if (perimeter <= 0) return std::nullopt;
  const double wanted = (volume - area) / perimeter / spacing;
  return Wish{.offset = std::clamp(wanted, -kMaxOffset, kMaxOffset),
              .trust = 1 - Smoothstep(kFadeFrom, kFadeTo, std::abs(wanted))};
}

}  // namespace

void MatchArea(const VertexInput& input, std::vector<double>& scratch,
               std::optional<double>& offset, Rings& rings) {
  const bool is_known = input.parameters.spacing.has_value() || !input.frame.volumes.empty();
  if (!is_known || !input.parameters.steps.area) return;
  const double spacing = input.scale.spacing * input.scale.cell_size;
  if (const std::optional<Wish> wish = WishOf(input, rings, spacing)) {
    // A frame that is not believed leaves the offset as it is: were it to fade, still outlines
    // would move.
    offset = offset ? *offset + kFollow * wish->trust * (wish->offset - *offset)
                    : wish->trust * wish->offset;
  }
  if (!offset) return;
  scratch.resize(rings.points.size());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    OffsetRing(rings.RingPoints(ring), *offset * spacing,
               scratch.data() + 2 * std::size_t{rings.offsets[ring]});
  });
  std::swap(rings.points, scratch);
}

}  // namespace partiemc
