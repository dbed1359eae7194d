// Samples the particles of each ring by their ids, and finds the last frame's samples again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "frame/particle_subset.h"
#include "identities/run_overlaps.h"
#include "partiemc/state.h"
#include "rings/components.h"
#include "rings/percolation.h"

namespace partiemc {

/// A sample of the last frame that is in a ring of this frame.
struct FoundSample {
  std::uint32_t before = 0, now = 0;  ///< Its rings: index in the history; number.
  CellShift displacement;             ///< Since the last frame.
};

/// Samples of a frame and their warm buffers.
struct RingSamples {
  std::vector<ParticleSample> samples;  ///< In any order; `ring` is a number.
  std::vector<FoundSample> found;       ///< By `before`, then `now`.

  // Scratch.
  std::vector<std::uint32_t> first_sample, sample_count;  // By number.
  std::vector<std::uint32_t> bucket;                      // HashIndex of the last samples.
  std::vector<std::uint64_t> known;                       // Bits of KnownHashes.
  std::vector<std::uint64_t> ring_limit, tile_limit;      // By number, by tile.
  struct Stretch {
    std::vector<std::uint64_t> home_limit;  // By home (BinScratch): limit of its tile.
    std::vector<std::uint32_t> chosen;      // Particles.
  };
  std::vector<Stretch> stretches;  // By stretch of the bins.
};

struct SampleInput {
  std::span<const std::uint64_t> ids;
  const ParticleBins& bins;
  const Crossings& crossings;
  const Components& components;
  std::span<const std::uint32_t> ring_of_component;  ///< By component: its outer ring, or kNoRing.
  std::span<const std::uint64_t> particle_count;     ///< By number (Components::CountParticles).
  const Percolation* percolation = nullptr;          ///< Null unless bodies will be cut.
  ParticleSubset subset = {};

  /// Whether a particle counts: copies of particles of bodies that will be cut do not, nor do
  /// particles of other phases. `source`: its index in the frame.
  bool Counts(std::uint32_t source, std::uint32_t component) const {
    if (!subset.Contains(source)) return false;
    return percolation == nullptr || percolation->Counts(source, component);
  }
};

/// Selects the samples of each outer ring, and finds the samples of the last frame.
///
/// The samples of a ring are its kMaxSamples particles with the smallest hashes of their ids: a
/// bottom-k sketch (Cohen, Kaplan: Summarizing data using bottom-k sketches, 2007). The samples are
/// a random choice, independent of the order of the particles, and mostly the same in the next
/// frame.
///
/// On average, 2 kMaxSamples of the n particles of a ring have hashes below 2 kMaxSamples / n of
/// the largest hash. This is the limit of the ring. One pass over the ids skips each particle whose
/// hash exceeds the limits of all rings near its tile, unless the particle is a sample of the last
/// frame. If a ring gets too few samples, a second pass selects them from all particles of the
/// tiles near it. The samples are therefore exact.
/// Cost: a hash and a comparison for each particle; log kMaxSamples for each particle that passes.
void SampleRings(const SampleInput& input, std::span<const ParticleSample> previous,
                 RingSamples& samples);

}  // namespace partiemc
