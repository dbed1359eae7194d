// Particles of rings by their ids: which of them the next frame remembers, and where those that the
// last frame remembered are now.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "identities/run_overlaps.h"
#include "partiemc/state.h"
#include "rings/components.h"

namespace partiemc {

/// A sample of the last frame that is in a ring of this one.
struct FoundSample {
  std::uint32_t before = 0, now = 0;  ///< Its rings: index in the history, number in this frame.
  CellShift way;                      ///< That it has gone.
};

/// Keeps its memory from frame to frame.
struct RingSamples {
  std::vector<ParticleSample> samples;  ///< In no order; `ring` is a number.
  std::vector<FoundSample> found;       ///< By `before`, then `now`.

  // Working memory.
  std::vector<std::uint32_t> first_sample, sample_count;  // By number.
  std::vector<std::uint32_t> bucket;                      // Of the last frame's samples, by hash.
  std::vector<std::uint64_t> known;                       // A bit for each leading part of a hash.
  std::vector<std::uint64_t> ring_limit, tile_limit;      // By number, by tile.
  struct Stretch {
    std::vector<std::uint64_t> home_limit;  // By home.
    std::vector<std::uint32_t> chosen;      // Particles.
  };
  std::vector<Stretch> stretches;  // By stretch of the bins.
};

struct SampleInput {
  std::span<const std::uint64_t> ids;
  const ParticleBins& bins;
  const Crossings& crossings;
  const Components& components;
  std::span<const std::uint32_t> ring_of_component;  ///< Number of its outer ring, or kNoRing.
  std::span<const std::uint64_t> particle_count;     ///< By number, as CountParticles counts.
};

/// Samples are the particles with the least hashes of their ids, kMaxSamples of each outer ring (a
/// bottom-k sketch: Cohen, Kaplan: Summarizing data using bottom-k sketches, 2007): a random choice
/// of places, the same whatever the order of the particles, and largely that of the next frame.
///
/// Of a ring of n particles twice as many as it needs lie below 2 kMaxSamples / n of the largest
/// hash. One pass over the ids leaves aside each particle that is above this limit for all rings
/// that its tile sees, and that the last frame does not remember. A ring that gets too few is
/// sampled anew from all particles of the tiles that see it, so the samples are exact.
/// Cost: a hash and a comparison for each particle; log n in samples for those that pass.
void SampleRings(const SampleInput& input, std::span<const ParticleSample> previous,
                 RingSamples& samples);

}  // namespace partiemc
