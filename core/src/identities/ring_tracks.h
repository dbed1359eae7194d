// Follows rings by the ids and velocities of their particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/ring_samples.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc {

/// Samples of the rings, and scratch of FollowParticles.
struct RingTracks {
  RingSamples by_id;
  std::vector<std::int64_t> sum_x, sum_y;  // Scratch, by number.
};

struct TrackInput {
  const Frame& frame;
  Plane plane;
  SampleInput particles;  ///< With the ids of the frame.
};

/// Samples the rings if the frame has ids (SampleRings), and sets the mean velocity of each outer
/// ring if the frame has velocities. The means are sums of integers, so they do not depend on the
/// order of the particles.
/// Requires: a checked frame; the velocities of `rings` are 0.
/// Cost: the cost of SampleRings; with velocities, also linear in particles.
void FollowParticles(const TrackInput& input, const RingHistory& previous,
                     std::span<KnownRing> rings, RingTracks& tracks);

}  // namespace partiemc
