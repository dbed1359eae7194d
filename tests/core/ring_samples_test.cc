#include "identities/ring_samples.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "base/id_hash.h"
#include "support/chosen_ids.h"
#include "support/random.h"
#include "support/stages.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Stages;

// A frame up to its components; each component represents one ring.
struct Traced {
  Stages stages;
  Components components;
  std::vector<std::uint32_t> ring_of_component;
  std::vector<std::uint64_t> particle_count;

  explicit Traced(const Particles& particles) {
    stages.Run(particles, {.spacing = 1});
    components.Label(stages.bins.tiles, stages.crossings);
    ring_of_component.resize(components.size());
    std::iota(ring_of_component.begin(), ring_of_component.end(), 0u);
    particle_count.resize(components.size());
    std::vector<double> weights(components.size());
    components.CountParticles(stages.bins, stages.crossings, particle_count, weights);
  }

  SampleInput Input(std::span<const std::uint64_t> ids) const {
    return {ids, stages.bins, stages.crossings, components, ring_of_component, particle_count};
  }
};

bool Precedes(const ParticleSample& a, const ParticleSample& b) {
  return std::tie(a.ring, a.hash) < std::tie(b.ring, b.hash);
}
bool FoundPrecedes(const FoundSample<RingPieces>& a, const FoundSample<RingPieces>& b) {
  return std::tie(a.before, a.now, a.displacement) < std::tie(b.before, b.now, b.displacement);
}

// All particles of all rings, sorted, and then the first ones of each ring.
void ExpectAsBySorting(const Traced& traced, std::span<const std::uint64_t> ids,
                       std::span<const ParticleSample> previous, RingSamples& tested) {
  SampleRings(traced.Input(ids), previous, tested);
  std::vector<ParticleSample> all;
  const ParticleBins& bins = traced.stages.bins;
  traced.components.ForEachParticle(
      bins, traced.stages.crossings,
      [&](std::uint32_t tile, std::uint32_t particle, std::uint32_t component) {
        const BinnedParticle& at = bins.particles[particle];
        all.push_back({HashOf(ids[at.source]),
                       bins.tiles[tile].x * kTileSize + static_cast<std::int32_t>(at.x + 0.5f),
                       bins.tiles[tile].y * kTileSize + static_cast<std::int32_t>(at.y + 0.5f),
                       component});
      });
  std::sort(all.begin(), all.end(), Precedes);
  std::vector<ParticleSample> expected;
  std::vector<std::uint32_t> taken(traced.components.size());
  for (const ParticleSample& sample : all) {
    if (taken[sample.ring]++ < kMaxSamples) expected.push_back(sample);
  }
  std::vector<FoundSample<RingPieces>> found;
  std::map<std::uint64_t, ParticleSample> known;
  for (const ParticleSample& sample : previous) known[sample.hash] = sample;
  for (const ParticleSample& now : all) {
    const auto before = known.find(now.hash);
    if (before == known.end()) continue;
    found.push_back({before->second.ring,
                     now.ring,
                     {std::int64_t{now.column} - before->second.column,
                      std::int64_t{now.row} - before->second.row}});
  }
  std::sort(found.begin(), found.end(), FoundPrecedes);
  std::sort(tested.samples.begin(), tested.samples.end(), Precedes);
  EXPECT_EQ(tested.samples, expected);
  EXPECT_TRUE(
      std::is_sorted(tested.found.begin(), tested.found.end(), [](const auto& a, const auto& b) {
        return std::tie(a.before, a.now) < std::tie(b.before, b.now);
      }));
  std::sort(tested.found.begin(), tested.found.end(), FoundPrecedes);
  ASSERT_EQ(tested.found.size(), found.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(tested.found[k].before, found[k].before);
    EXPECT_EQ(tested.found[k].now, found[k].now);
    EXPECT_EQ(tested.found[k].displacement, found[k].displacement);
  }
}

// Large bodies beside small ones, spray around them; more than one stretch of particles.
Particles Bodies(std::uint64_t seed) {
  support::Random random(seed);
  Particles particles = support::Disc(110);
  for (int k = 0; k < 30; ++k) {
    particles.Add(support::Disc(random.Uniform(0.5, 14), random.Uniform(-300, 300),
                                random.Uniform(-300, 300)));
  }
  particles.Add(support::Noise(random, 200, 400));
  return support::Permuted(particles, random);
}

std::vector<ParticleSample> ByHash(std::vector<ParticleSample> samples) {
  std::sort(samples.begin(), samples.end(),
            [](const ParticleSample& a, const ParticleSample& b) { return a.hash < b.hash; });
  return samples;
}

TEST(RingSamples, HaveTheSmallestHashesForAnyIds) {
  constexpr std::uint64_t kLargest = std::numeric_limits<std::uint64_t>::max();
  RingSamples samples;  // Reused: one call must not affect the next.
  for (std::uint64_t seed = 1; seed <= support::Tries(4u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Traced traced(Bodies(seed));
    const std::size_t count = traced.stages.particles.size();
    ASSERT_GT(count, 38'000u);
    support::Random random(seed);
    std::vector<std::uint64_t> dense(count), sparse(count), last(count), first(count);
    for (std::size_t k = 0; k < count; ++k) {
      dense[k] = k;
      sparse[k] = random.Bits();
      // Ids chosen such that no hash, or every hash, is below the limit of a ring. They include the
      // smallest and the largest hash.
      last[k] = support::IdWithHash(kLargest - k);
      first[k] = support::IdWithHash(k);
    }
    ASSERT_EQ(HashOf(last[7]), kLargest - 7);
    std::vector<ParticleSample> previous;
    for (const auto* const ids : {&dense, &sparse, &last, &first, &dense}) {
      ExpectAsBySorting(traced, *ids, previous, samples);
      previous = ByHash(samples.samples);
      // Samples of the last frame are found in any ring and with any hash.
      const Traced moved(Bodies(seed + 100));
      std::vector<std::uint64_t> again(ids->begin(), ids->end());
      again.resize(moved.stages.particles.size(), 0);
      for (std::size_t k = count; k < again.size(); ++k)
        again[k] = support::IdWithHash(kLargest / 2 + k);
      ExpectAsBySorting(moved, again, previous, samples);
      EXPECT_GT(samples.found.size(), 16u);
      previous = ByHash(samples.samples);
    }
  }
}

TEST(RingSamples, AreFoundInAnotherBody) {
  // A drop has fallen into the body. The hashes of most of its samples exceed the body's limit.
  RingSamples samples;
  const Traced apart([] {
    Particles particles = support::Disc(60);
    particles.Add(support::Disc(2, 80, 0));
    return particles;
  }());
  std::vector<std::uint64_t> ids(apart.stages.particles.size());
  std::iota(ids.begin(), ids.end(), std::uint64_t{0});
  ExpectAsBySorting(apart, ids, {}, samples);
  const std::vector<ParticleSample> previous = ByHash(samples.samples);
  ASSERT_EQ(previous.size(), kMaxSamples + support::Disc(2).size());
  const Traced whole([] {
    Particles particles = support::Disc(60);
    particles.Add(support::Disc(2, 50, 0.5));
    return particles;
  }());
  ASSERT_EQ(whole.components.size(), 1u);
  ExpectAsBySorting(whole, ids, previous, samples);
  EXPECT_EQ(samples.found.size(), previous.size());
}

TEST(RingSamples, DoNotDependOnThreads) {
  const Particles particles = Bodies(9);
  RingSamples expected;
  for (const int threads : {1, 2, 7}) {
    SCOPED_TRACE(testing::Message() << threads << " threads");
    tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] {
      const Traced traced(particles);
      std::vector<std::uint64_t> ids(particles.size());
      std::iota(ids.begin(), ids.end(), std::uint64_t{0});
      RingSamples samples;
      SampleRings(traced.Input(ids), {}, samples);
      if (threads == 1) expected = samples;
      EXPECT_EQ(ByHash(samples.samples), ByHash(expected.samples));
    });
  }
}

}  // namespace
}  // namespace partiemc
