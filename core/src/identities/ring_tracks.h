// What ids and velocities of particles tell of rings: where the particles of a ring have gone, and
// how fast it moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/ring_samples.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc {

/// By numbers of the rings of a frame; keeps its memory from frame to frame.
struct RingTracks {
  RingSamples by_id;
  std::vector<std::int64_t> sum_x, sum_y;  // Working memory.
};

struct TrackInput {
  const Frame& frame;
  Plane plane;
  SampleInput particles;  ///< With the ids of the frame.
};

/// Follows the particles of a checked frame: samples as SampleRings takes them, and the velocities
/// of `rings`, which are 0 before: means over the particles, in sums of integers, which have no
/// order. Without ids there are no samples, without velocities they stay 0. Cost: that of
/// SampleRings; with velocities, linear in particles.
void FollowParticles(const TrackInput& input, const RingHistory& previous,
                     std::span<KnownRing> rings, RingTracks& tracks);

}  // namespace partiemc
