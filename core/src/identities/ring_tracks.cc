#include "identities/ring_tracks.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace partiemc {
namespace {

// Converts velocities to integers. The unit is a power of two, chosen such that the sum over all
// particles fits into 62 bits. Sums are therefore exact and do not depend on the order.
class VelocityUnits {
 public:
  explicit VelocityUnits(const Frame& frame) {
    float largest = 0;
    for (const float value : frame.velocities) largest = std::max(largest, std::abs(value));
    if (largest == 0) return;
    int exponent = 0;
    std::frexp(largest, &exponent);  // frexp and ldexp only change exponents: they are exact.
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

void FollowParticles(const TrackInput& input, const RingHistory& previous,
                     std::span<KnownRing> rings, RingTracks& t) {
  const Frame& frame = input.frame;
  const SampleInput& in = input.particles;
  t.by_id.samples.clear();
  t.by_id.found.clear();
  if (!frame.ids.empty()) SampleRings(in, previous.samples, t.by_id);
  if (frame.velocities.empty()) return;
  t.sum_x.assign(rings.size(), 0);
  t.sum_y.assign(rings.size(), 0);
  const VelocityUnits units(frame);
  const auto add = [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
    const std::uint32_t ring = in.ring_of_component[component];
    if (ring == kNoRing) return;
    const PlaneVelocity velocity =
        VelocityOf(frame, input.plane, in.bins.particles[particle].source);
    t.sum_x[ring] += units.Of(velocity.x);
    t.sum_y[ring] += units.Of(velocity.y);
  };
  in.components.ForEachParticle(in.bins, in.crossings, add);
  for (std::size_t ring = 0; ring < rings.size(); ++ring) {
    if (in.particle_count[ring] == 0) continue;
    rings[ring].velocity_x = units.Mean(t.sum_x[ring], in.particle_count[ring]);
    rings[ring].velocity_y = units.Mean(t.sum_y[ring], in.particle_count[ring]);
  }
}

}  // namespace partiemc
