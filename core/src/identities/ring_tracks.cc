#include "identities/ring_tracks.h"

#include "identities/velocity_units.h"

namespace partiemc {
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
    const std::uint32_t source = in.bins.particles[particle].source;
    if (ring == kNoRing || !in.Counts(source, component)) return;
    const PlaneVelocity velocity = VelocityOf(frame, input.plane, source);
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
