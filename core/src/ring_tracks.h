// What ids and velocities of particles tell of rings: where the particles of a ring have gone, and
// how fast it moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins.h"
#include "components.h"
#include "crossings.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "run_overlaps.h"

namespace partiemc {

/// A sample of the last frame that is in a ring of this one.
struct FoundSample {
  std::uint32_t before = 0, now = 0;  ///< Its rings: index in the history, number in this frame.
  CellShift way;                      ///< That it has gone.
};

/// By numbers of the rings of a frame; keeps its memory from frame to frame.
struct RingTracks {
  std::vector<ParticleSample> samples;         ///< In no order; `ring` is a number.
  std::vector<FoundSample> found;              ///< By `before`, then `now`.
  std::vector<double> velocity_x, velocity_y;  ///< World units per time; 0 for holes.

  // Working memory.
  std::vector<std::uint32_t> first_sample, sample_count;  // By number.
  std::vector<std::uint32_t> bucket;                      // Of the last frame's samples, by hash.
  std::vector<std::int64_t> sum_x, sum_y;                 // By number.
};

struct TrackInput {
  const Frame& frame;
  Plane plane;
  const ParticleBins& bins;
  const Crossings& crossings;
  const Components& components;
  std::span<const std::uint32_t> ring_of_component;  ///< Number of its outer ring, or kNoRing.
  std::span<const std::uint64_t> particle_count;     ///< By number, as CountParticles counts.
};

/// Follows the particles of a checked frame.
///   samples     the particles with the least hashes of their ids, kMaxSamples of each outer ring:
///               the same whatever the order of the particles, a random choice as to where they
///               are, and, as hashes stay, largely the same ones in the next frame;
///   velocities  means over the particles, in sums of integers, which have no order either.
/// Without ids there are no samples, without velocities they are 0. Cost: linear in particles and
/// samples; nothing without both.
void FollowParticles(const TrackInput& input, const RingHistory& previous, RingTracks& tracks);

}  // namespace partiemc
