// Samples the particles of each ring by their ids, and finds the last frame's samples again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "frame/particle_subset.h"
#include "identities/piece_relations.h"
#include "partiemc/state.h"
#include "rings/components.h"
#include "rings/percolation.h"

namespace partiemc {

/// Samples of a frame, and scratch of SampleRings.
struct RingSamples {
  std::vector<ParticleSample> samples;         ///< By ring, then in any order; `ring` is a number.
  std::vector<FoundSample<RingPieces>> found;  ///< Sorted by `before`, then `now`.

  // Scratch.
  std::vector<std::uint32_t> first_sample, sample_count;  // By number.
  std::vector<std::uint32_t> bucket;                      // Of the HashIndex of the last samples.
  std::vector<std::uint64_t> known;                       // Bits of KnownHashes.
  // The largest accepted hash of an id: of a ring, by number; of a tile, by tile.
  std::vector<std::uint64_t> ring_limit, tile_limit;
  struct Stretch {
    std::vector<std::uint64_t> home_limit;  // By tile of the stretch: largest accepted hash.
    std::vector<std::uint32_t> chosen;      // Particles that the first pass does not skip.
  };
  std::vector<Stretch> stretches;  // By stretch of the bins.
};

struct SampleInput {
  std::span<const std::uint64_t> ids;
  const ParticleBins& bins;
  const Crossings& crossings;
  const Components& components;
  std::span<const std::uint32_t> ring_of_component;  ///< By component: number of its outer ring.
  std::span<const std::uint64_t> particle_count;     ///< By number: its particles (see Counts).
  const Percolation* percolation = nullptr;          ///< Null: the frame has no copies.
  ParticleSubset subset = {};

  /// False for copies of particles of bodies that will be cut, and for particles outside of
  /// `subset`. `source`: the particle's index in the frame.
  bool Counts(std::uint32_t source, std::uint32_t component) const {
    if (!subset.Contains(source)) return false;
    return percolation == nullptr || percolation->Counts(source, component);
  }
};

/// Selects the samples of each outer ring. Also finds the particles that were samples in the last
/// frame: RingSamples::found has their ring before, their ring now, and their displacement.
///
/// The samples of a ring are its kMaxSamples particles with the smallest hashes of their ids: a
/// bottom-k sketch (Cohen, Kaplan: Summarizing data using bottom-k sketches, 2007). They are a
/// random choice, independent of the order of the particles, and mostly the same in the next frame.
///
/// The result is exact, but most particles are skipped early:
/// 1. The limit of a ring is the hash below which 2 kMaxSamples of its particles are expected. The
///    limit of a tile is the largest limit of the rings near it.
/// 2. The first pass visits all ids. It skips a particle if its hash exceeds the limit of its tile,
///    except samples of the last frame.
/// 3. If a ring has too few samples after the first pass, the second pass selects them from all
///    particles of the tiles near the ring.
/// Cost: a hash and a comparison for each particle; log kMaxSamples for each particle that passes.
void SampleRings(const SampleInput& input, std::span<const ParticleSample> previous,
                 RingSamples& samples);

}  // namespace partiemc
