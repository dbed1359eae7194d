#include "rings/components.h"

#include <gtest/gtest.h>

#include <numeric>

#include "support/random.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::Stages;

struct Reach {
  double kernel_radius, cell_size;
};

// The widest kernel on the finest cells has the farthest reach: a whole tile.
class ParticlesOfComponents : public testing::TestWithParam<Reach> {};

TEST_P(ParticlesOfComponents, AreCountedAsIfEachWereAskedForItsNearestInsideCorner) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    support::Particles particles = support::Blob(random, 12);
    particles.Add(support::Noise(random, 60, 60));
    if (seed % 2 == 0) {
      for (std::size_t k = 0; k < particles.size(); ++k) {
        particles.volumes.push_back(static_cast<float>(random.Uniform(0.5, 2)));
      }
    }
    Stages stages;
    stages.Run(particles, {.spacing = 1,
                           .kernel_radius = GetParam().kernel_radius,
                           .cell_size = GetParam().cell_size,
                           .clean = false});
    Components components;
    components.Label(stages.bins.tiles, stages.crossings);
    ASSERT_GT(components.size(), 0u);
    std::vector<std::uint64_t> counts(components.size()), asked(components.size());
    std::vector<double> weights(components.size()), asked_weights(components.size());
    components.CountParticles(stages.bins, stages.crossings, counts, weights);
    components.ForEachParticle(stages.bins, stages.crossings,
                               [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
                                 ++asked[component];
                                 if (!stages.bins.weight.empty()) {
                                   asked_weights[component] += stages.bins.weight[particle];
                                 }
                               });
    EXPECT_EQ(counts, asked);
    EXPECT_EQ(stages.bins.weight.empty(), particles.volumes.empty());
    for (std::size_t k = 0; k < weights.size(); ++k) {
      EXPECT_NEAR(weights[k], asked_weights[k], 1e-9 * asked_weights[k]);
    }
    EXPECT_GT(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), 300u);
  }
}

INSTANTIATE_TEST_SUITE_P(Reaches, ParticlesOfComponents,
                         testing::Values(Reach{1.5, 1}, Reach{3, 1}, Reach{3, 0.25}, Reach{8, 1},
                                         Reach{8, 0.25}));

}  // namespace
}  // namespace partiemc
