#include "identities/ring_samples.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "base/id_hash.h"
#include "base/parallel.h"
#include "identities/smallest_hashes.h"
#include "partiemc/result.h"

namespace partiemc {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// Expected number of particles below the limit of a ring, divided by kMaxSamples. With 2, one ring
// in 1,500 finds too few and needs the second pass. A larger value would cost time for every ring.
constexpr std::uint64_t kSurplus = 2;

ParticleSample SampleAt(const TileCoordinate& tile, float x, float y, std::uint64_t id,
                        std::uint32_t ring) {
  const auto nearest_node = [](std::int32_t coordinate, float relative) {
    return coordinate * kTileSize + static_cast<std::int32_t>(relative + 0.5f);
  };
  return {HashOf(id), nearest_node(tile.x, x), nearest_node(tile.y, y), ring};
}

// Reserves a range of samples for each ring, one for each particle, but at most kMaxSamples.
void ReserveSamples(std::span<const std::uint64_t> particle_count, RingSamples& s) {
  s.first_sample.clear();
  std::uint32_t count = 0;
  for (const std::uint64_t particles : particle_count) {
    s.first_sample.push_back(count);
    count += static_cast<std::uint32_t>(std::min<std::uint64_t>(particles, kMaxSamples));
  }
  s.samples.resize(count);
  s.sample_count.assign(particle_count.size(), 0);
}

void TakeSample(const ParticleSample& sample, RingSamples& s) {
  AddToHeap(sample, s.samples.data() + s.first_sample[sample.ring], s.sample_count[sample.ring]);
}

// The largest hash that the first pass accepts for a ring.
std::uint64_t LimitOf(std::uint64_t particles) {
  constexpr std::uint64_t kWanted = kSurplus * kMaxSamples;
  return particles <= kWanted ? kNoLimit : kNoLimit / particles * kWanted;
}

// Sets the limit of each tile: the largest limit of the rings to which its particles may belong.
void SetTileLimits(const SampleInput& input, RingSamples& s) {
  const auto tiles = static_cast<std::uint32_t>(input.bins.tiles.size());
  s.tile_limit.assign(tiles, 0);
  ParallelFor(tiles, [&](std::uint32_t tile) {
    if (input.bins.CountOf(tile) == 0) return;
    input.components.ForEachSeenFrom(
        input.bins.tiles, input.crossings, tile, [&](std::uint32_t component) {
          const std::uint32_t ring = input.ring_of_component[component];
          if (ring == kNoRing) return;
          s.tile_limit[tile] = std::max(s.tile_limit[tile], s.ring_limit[ring]);
        });
  });
}

// Lists the particles that may become samples or were samples of the last frame.
void ChooseParticles(const SampleInput& input, const KnownHashes& known,
                     const HashIndex<ParticleSample>& index, RingSamples& s) {
  const std::span<const BinStretch> stretches = input.bins.scratch.stretches;
  if (s.stretches.size() < stretches.size()) s.stretches.resize(stretches.size());
  ParallelFor(stretches.size(), [&](std::size_t k) {
    const BinStretch& stretch = stretches[k];
    auto& [home_limit, chosen] = s.stretches[k];
    home_limit.clear();
    for (const std::uint32_t tile : stretch.tiles) home_limit.push_back(s.tile_limit[tile]);
    chosen.clear();
    const std::uint64_t* const limit = home_limit.data();
    const std::uint32_t* const home = input.bins.scratch.home.data();
    for (std::size_t particle = stretch.first; particle < stretch.last; ++particle) {
      const std::uint64_t hash = HashOf(input.ids[particle]);
      if (hash <= limit[home[particle]] || (known.MayHave(hash) && index.Find(hash) != nullptr)) {
        chosen.push_back(static_cast<std::uint32_t>(particle));
      }
    }
  });
}

// Calls visit(sample) for each chosen particle that belongs to a ring.
template <typename Visit>
void ForEachChosen(const SampleInput& input, const RingSamples& s, Visit visit) {
  const BinScratch& scratch = input.bins.scratch;
  for (std::size_t k = 0; k < scratch.stretches.size(); ++k) {
    for (const std::uint32_t particle : s.stretches[k].chosen) {
      const std::uint32_t tile = scratch.stretches[k].tiles[scratch.home[particle]];
      const float x = scratch.positions[2 * std::size_t{particle}];
      const float y = scratch.positions[2 * std::size_t{particle} + 1];
      const std::uint32_t component =
          input.components.ComponentOf(input.bins.tiles, input.crossings, tile, x, y);
      if (component == kNoComponent || !input.Counts(particle, component)) continue;
      const std::uint32_t ring = input.ring_of_component[component];
      if (ring == kNoRing) continue;
      visit(SampleAt(input.bins.tiles[tile], x, y, input.ids[particle], ring));
    }
  }
}

// The second pass: for each ring that got too few samples, selects its samples from all of its
// particles.
void FillShortRings(const SampleInput& input, RingSamples& s) {
  bool any = false;
  for (std::size_t ring = 0; ring < s.ring_limit.size(); ++ring) {
    const std::size_t end =
        ring + 1 < s.first_sample.size() ? s.first_sample[ring + 1] : s.samples.size();
    const bool is_short = s.first_sample[ring] + s.sample_count[ring] < end;
    s.ring_limit[ring] = is_short ? kNoLimit : 0;
    if (is_short) s.sample_count[ring] = 0;
    any = any || is_short;
  }
  if (!any) return;
  SetTileLimits(input, s);
  for (std::uint32_t tile = 0; tile < input.bins.tiles.size(); ++tile) {
    if (s.tile_limit[tile] == 0) continue;
    input.components.ForEachParticleOf(
        input.bins, input.crossings, tile,
        [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
          const std::uint32_t ring = input.ring_of_component[component];
          if (ring == kNoRing || s.ring_limit[ring] == 0) return;
          const BinnedParticle& at = input.bins.particles[particle];
          if (!input.Counts(at.source, component)) return;
          TakeSample(SampleAt(input.bins.tiles[tile], at.x, at.y, input.ids[at.source], ring), s);
        });
  }
}

}  // namespace

void SampleRings(const SampleInput& input, std::span<const ParticleSample> previous,
                 RingSamples& s) {
  ReserveSamples(input.particle_count, s);
  s.ring_limit.clear();
  for (const std::uint64_t count : input.particle_count) s.ring_limit.push_back(LimitOf(count));
  SetTileLimits(input, s);
  const HashIndex<ParticleSample> index(previous, s.bucket);
  ChooseParticles(input, KnownHashes(previous, s.known), index, s);
  s.found.clear();
  ForEachChosen(input, s, [&](const ParticleSample& now) {
    // A sample of the last frame that exceeds the limit is not added: in a full heap, it would hide
    // that particles with smaller hashes are missing.
    if (now.hash <= s.ring_limit[now.ring]) TakeSample(now, s);
    if (const ParticleSample* const before = index.Find(now.hash)) {
      s.found.push_back(
          {before->ring,
           now.ring,
           {std::int64_t{now.column} - before->column, std::int64_t{now.row} - before->row}});
    }
  });
  std::ranges::sort(s.found, [](const auto& x, const auto& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  FillShortRings(input, s);
}

}  // namespace partiemc
