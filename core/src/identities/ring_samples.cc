#include "identities/ring_samples.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <tuple>

#include "base/id_hash.h"
#include "base/parallel.h"
#include "partiemc/result.h"

namespace partiemc {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// How many times as many particles as a ring needs lie below its limit, on average. Of 32 expected
// ones less than 16 are found in one case of 1,500: so few rings are made up for at little cost,
// and more would cost every ring something.
constexpr std::uint64_t kSurplus = 2;

bool HasLessHash(const ParticleSample& a, const ParticleSample& b) { return a.hash < b.hash; }

ParticleSample SampleAt(const TileCoordinate& tile, float x, float y, std::uint64_t id,
                        std::uint32_t ring) {
  const auto nearest_node = [](std::int32_t coordinate, float relative) {
    return coordinate * kTileSize + static_cast<std::int32_t>(relative + 0.5f);
  };
  return {HashOf(id), nearest_node(tile.x, x), nearest_node(tile.y, y), ring};
}

// Where each ring's samples go: as many places as it has particles, kMaxSamples at most.
void ReserveSamples(std::span<const std::uint64_t> particle_count, RingSamples& s) {
  s.first_sample.clear();
  std::uint32_t places = 0;
  for (const std::uint64_t particles : particle_count) {
    s.first_sample.push_back(places);
    places += static_cast<std::uint32_t>(std::min<std::uint64_t>(particles, kMaxSamples));
  }
  s.samples.resize(places);
  s.sample_count.assign(particle_count.size(), 0);
}

// A ring's samples are a heap: the one with the largest hash is the next to go.
void TakeSample(const ParticleSample& sample, RingSamples& s) {
  ParticleSample* const first = s.samples.data() + s.first_sample[sample.ring];
  std::uint32_t& count = s.sample_count[sample.ring];
  if (count == kMaxSamples) {
    if (!HasLessHash(sample, *first)) return;
    std::pop_heap(first, first + count, HasLessHash);
    --count;
  }
  first[count++] = sample;
  std::push_heap(first, first + count, HasLessHash);
}

// Which hashes may be those of samples: a bit for each leading part of a hash. At most one in 32
// others passes, one in thousands where samples are few.
class KnownHashes {
 public:
  KnownHashes(std::span<const ParticleSample> samples, std::vector<std::uint64_t>& bits)
      : shift_(64 - std::max(kMinBits, static_cast<int>(std::bit_width(32 * samples.size())))) {
    bits.assign(std::size_t{1} << (64 - shift_ - 6), 0);
    for (const ParticleSample& sample : samples) {
      const std::uint64_t place = sample.hash >> shift_;
      bits[place / 64] |= std::uint64_t{1} << (place % 64);
    }
    bits_ = bits.data();
  }

  bool MayHave(std::uint64_t hash) const {
    const std::uint64_t place = hash >> shift_;
    return (bits_[place / 64] >> (place % 64) & 1) != 0;
  }

 private:
  static constexpr int kMinBits = 15;  // 4 kB, which stay in the nearest cache.
  int shift_;
  const std::uint64_t* bits_;
};

// Below which hashes a ring's samples are looked for.
std::uint64_t LimitOf(std::uint64_t particles) {
  constexpr std::uint64_t kWanted = kSurplus * kMaxSamples;
  return particles <= kWanted ? kNoLimit : kNoLimit / particles * kWanted;
}

// Of each tile the largest limit of the rings that its particles may be in.
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

// Whether no tile's limit keeps a sample of the last frame from being chosen: as a rule in frames
// of large bodies, to which one look-up less for each particle is due.
bool LimitsCover(std::span<const ParticleSample> samples, const RingSamples& s) {
  if (samples.empty()) return true;
  return std::all_of(s.tile_limit.begin(), s.tile_limit.end(), [&](std::uint64_t limit) {
    return limit == 0 || limit >= samples.back().hash;
  });
}

// The particles that may be samples or, as `is_known` says, have been.
void ChooseParticles(const SampleInput& input, const auto& is_known, RingSamples& s) {
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
      if (hash <= limit[home[particle]] || is_known(hash)) {
        chosen.push_back(static_cast<std::uint32_t>(particle));
      }
    }
  });
}

// Particles that are looked up together, so that their memory, which is anywhere, comes at once.
constexpr std::size_t kBlock = 32;

// Calls visit(sample) for each chosen particle that is in a ring.
template <typename Visit>
void ForEachChosen(const SampleInput& input, const RingSamples& s, Visit visit) {
  struct Place {
    std::uint32_t tile;
    float x, y;
    std::uint64_t id;
  };
  std::array<Place, kBlock> places;
  const BinScratch& scratch = input.bins.scratch;
  for (std::size_t k = 0; k < scratch.stretches.size(); ++k) {
    const std::vector<std::uint32_t>& tiles = scratch.stretches[k].tiles;
    std::span<const std::uint32_t> rest = s.stretches[k].chosen;
    while (!rest.empty()) {
      const auto block = rest.first(std::min(kBlock, rest.size()));
      rest = rest.subspan(block.size());
      for (std::size_t p = 0; p < block.size(); ++p) {
        const std::size_t particle = block[p];
        const std::uint32_t tile = tiles[scratch.home[particle]];
        places[p] = {tile, scratch.positions[2 * particle], scratch.positions[2 * particle + 1],
                     input.ids[particle]};
        hwy::Prefetch(&input.crossings.tiles[tile].inside[static_cast<int>(places[p].y)]);
        hwy::Prefetch(&input.bins.tiles[tile]);
        input.components.Prefetch(tile, static_cast<int>(places[p].y));
      }
      for (const Place& place : std::span(places).first(block.size())) {
        const std::uint32_t component = input.components.ComponentOf(
            input.bins.tiles, input.crossings, place.tile, place.x, place.y);
        if (component == kNoComponent) continue;
        const std::uint32_t ring = input.ring_of_component[component];
        if (ring == kNoRing) continue;
        visit(SampleAt(input.bins.tiles[place.tile], place.x, place.y, place.id, ring));
      }
    }
  }
}

// The rings that lack samples get all of their particles to choose from.
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
  if (LimitsCover(previous, s)) {
    ChooseParticles(
        input, [](std::uint64_t) { return false; }, s);
  } else {
    const KnownHashes known(previous, s.known);
    ChooseParticles(
        input,
        [&](std::uint64_t hash) { return known.MayHave(hash) && index.Find(hash) != nullptr; }, s);
  }
  s.found.clear();
  ForEachChosen(input, s, [&](const ParticleSample& now) {
    // Only what is below the limit: a ring must not seem to be full by others.
    if (now.hash <= s.ring_limit[now.ring]) TakeSample(now, s);
    if (const ParticleSample* const before = index.Find(now.hash)) {
      s.found.push_back(
          {before->ring,
           now.ring,
           {std::int64_t{now.column} - before->column, std::int64_t{now.row} - before->row}});
    }
  });
  std::sort(s.found.begin(), s.found.end(), [](const FoundSample& x, const FoundSample& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  FillShortRings(input, s);
}

}  // namespace partiemc
