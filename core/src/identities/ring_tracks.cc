#include "identities/ring_tracks.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace partiemc {
namespace {

// Velocities as integers: in units of a power of two, so small that the largest of them times the
// number of particles fits into 62 bits. Sums are then exact, hence the same in any order.
class VelocityUnits {
 public:
  explicit VelocityUnits(const Frame& frame) {
    float largest = 0;
    for (const float value : frame.velocities) largest = std::max(largest, std::abs(value));
    if (largest == 0) return;
    int exponent = 0;
    std::frexp(largest, &exponent);  // This and ldexp touch exponents only: they are exact.
    per_unit_ =
        std::ldexp(1.0, 62 - static_cast<int>(std::bit_width(frame.ParticleCount())) - exponent);
  }

  std::int64_t Of(float value) const { return static_cast<std::int64_t>(value * per_unit_); }
  double Mean(std::int64_t sum, std::uint64_t count) const {
    return static_cast<double>(sum) / static_cast<double>(count) / per_unit_;
  }

 private:
  double per_unit_ = 1;
};

}  // namespace

void FollowParticles(const TrackInput& input, const RingHistory& previous, RingTracks& t) {
  const Frame& frame = input.frame;
  const std::size_t rings = input.particle_count.size();
  t.by_id.samples.clear();
  t.by_id.found.clear();
  t.velocity_x.assign(rings, 0);
  t.velocity_y.assign(rings, 0);
  if (!frame.ids.empty()) {
    SampleRings({frame.ids, input.bins, input.crossings, input.components, input.ring_of_component,
                 input.particle_count},
                previous.samples, t.by_id);
  }
  if (frame.velocities.empty()) return;
  t.sum_x.assign(rings, 0);
  t.sum_y.assign(rings, 0);
  const VelocityUnits units(frame);
  input.components.ForEachParticle(
      input.bins, input.crossings,
      [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
        const std::uint32_t ring = input.ring_of_component[component];
        if (ring == kNoRing) return;
        const PlaneVelocity velocity =
            VelocityOf(frame, input.plane, input.bins.particles[particle].source);
        t.sum_x[ring] += units.Of(velocity.x);
        t.sum_y[ring] += units.Of(velocity.y);
      });
  for (std::size_t ring = 0; ring < rings; ++ring) {
    if (input.particle_count[ring] == 0) continue;
    t.velocity_x[ring] = units.Mean(t.sum_x[ring], input.particle_count[ring]);
    t.velocity_y[ring] = units.Mean(t.sum_y[ring], input.particle_count[ring]);
  }
}

}  // namespace partiemc
