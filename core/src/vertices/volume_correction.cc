#include "vertices/volume_correction.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "vertices/measure.h"
#include "vertices/ring_offset.h"

namespace partiemc {
namespace {

// Sum of the volumes of an outer ring's particles, in cells.
double VolumeOf(const VertexInput& input, std::size_t ring) {
  if (input.frame.volumes.empty()) {
    const double each = input.scale.spacing * input.scale.spacing;
    return static_cast<double>(input.topology.particle_count[ring]) * each;
  }
  return input.topology.particle_weight[ring] / input.scale.weight_per_volume;
}

// The offset that a frame alone would ask for, in spacings. Nothing without large components.
std::optional<double> TargetOf(const VertexInput& input, double spacing, Rings& rings) {
  const VirtualPlaneConstants& constants = input.parameters.constants;
  rings.measures.resize(rings.RingCount());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    rings.measures[ring] = MeasureRing(rings.RingPoints(ring));
  });
  double volume = 0, area = 0, perimeter = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    const std::size_t outer = is_outer ? ring : rings.outer_of[ring];
    // Spray: its area says how it broke off.
    if (rings.measures[outer].perimeter < constants.ShortestRing() * spacing) continue;
    if (is_outer) volume += VolumeOf(input, ring);
    area += rings.measures[ring].area;
    perimeter += rings.measures[ring].perimeter;
  }
  if (perimeter <= 0) return std::nullopt;
  volume *= input.scale.cell_size * input.scale.cell_size;
  return std::clamp((volume - area) / perimeter / spacing, -constants.area_limit,
                    constants.area_limit);
}

}  // namespace

void CorrectVolume(const VertexInput& input, std::vector<double>& scratch,
                   std::optional<double>& offset, Rings& rings) {
  const bool is_known = input.parameters.spacing.has_value() || !input.frame.volumes.empty();
  if (!is_known || !input.parameters.steps.area) return;
  const double spacing = input.scale.spacing * input.scale.cell_size;
  if (const std::optional<double> target = TargetOf(input, spacing, rings)) {
    const double change = input.parameters.constants.area_change;
    offset = offset ? std::clamp(*target, *offset - change, *offset + change) : *target;
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
