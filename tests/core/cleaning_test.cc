// The rings that cleaning and the limits of spray drop, and the effect on nodes and particles.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "partiemc/validate.h"
#include "rings/rings.h"
#include "support/levels_by_hand.h"
#include "support/particles.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::At;
using support::Circle;
using support::kHigh;
using support::kLow;
using support::Particles;
using support::Plain;
using support::Stages;

// A disc of radius 12 with a round hole at (cx, cy).
struct Holed {
  double cx, cy, hole;
  double operator()(int x, int y) const {
    return std::max(Circle(x, y, 32, 32, 12), -Circle(x, y, cx, cy, hole));
  }
};

double HoleArea(const Stages& stages) {
  for (const RingMeasures& measures : stages.result.rings.measures) {
    if (measures.area < 0) return -measures.area;
  }
  return 0;
}

TEST(Cleaning, HolesBelowTwoParticlesAreDroppedAndLargerOnesKept) {
  // Holes on a tile's corner, on a seam and within a tile; spacings of one and of two cells.
  int dropped = 0, kept = 0;
  for (const auto& [cx, cy] : {std::pair(32.0, 32.0), {31.6, 28.3}, {36.2, 35.4}}) {
    for (const double spacing : {1.0, 2.0}) {
      for (const double radius : {0.6, 0.75, 0.9, 1.2, 1.6}) {
        const Particles particles = At({{24, 32}});
        ReconstructionParameters parameters = Plain(false);
        parameters.spacing = spacing;
        parameters.cell_size = 1 / spacing;
        Stages unclean;
        unclean.RunOn(Holed{cx, cy, radius * spacing}, kLow, kHigh, particles, parameters);
        const double area = HoleArea(unclean);
        ASSERT_GT(area, 0);
        parameters.clean = true;
        Stages clean;
        clean.RunOn(Holed{cx, cy, radius * spacing}, kLow, kHigh, particles, parameters);
        const bool small = area < 2 * spacing * spacing;
        EXPECT_EQ(clean.topology.dropped_holes, small ? 1u : 0u) << "area " << area;
        EXPECT_EQ(clean.topology.RingCount(), small ? 1u : 2u);
        EXPECT_TRUE(Validate(clean.result).ok()) << Validate(clean.result);
        ++(small ? dropped : kept);
      }
    }
  }
  EXPECT_GT(dropped, 5);
  EXPECT_GT(kept, 5);
}

TEST(Cleaning, TheCellsOfADroppedHoleBecomeInterior) {
  Stages full, dropped;
  full.RunOn([](int x, int y) { return Circle(x, y, 32, 32, 12); }, kLow, kHigh, At({{24, 32}}),
             Plain(true));
  dropped.RunOn(Holed{32, 32, 0.75}, kLow, kHigh, At({{24, 32}}), Plain(true));
  for (std::size_t tile = 0; tile < full.crossings.tiles.size(); ++tile) {
    EXPECT_EQ(full.crossings.interior[tile], dropped.crossings.interior[tile]);
  }
  EXPECT_EQ(full.result.rings.points, dropped.result.rings.points);
}

TEST(Cleaning, AComponentWithoutAParticleIsDroppedWithItsHoles) {
  const auto two = [](int x, int y) {
    const double ring = std::max(Circle(x, y, 45, 45, 9), -Circle(x, y, 45, 45, 4));
    return std::min(Circle(x, y, 20, 20, 7), ring);
  };
  Stages unclean;
  unclean.RunOn(two, kLow, kHigh, At({{20, 22}}), Plain(false));
  EXPECT_EQ(unclean.topology.RingCount(), 3u);
  Stages clean;
  clean.RunOn(two, kLow, kHigh, At({{20, 22}}), Plain(true));
  EXPECT_EQ(clean.topology.RingCount(), 1u);
  EXPECT_EQ(clean.topology.dropped_components, 1u);
  EXPECT_EQ(clean.topology.dropped_holes, 0u);
  EXPECT_EQ(clean.topology.particle_count, (std::vector<std::uint64_t>{1}));
  EXPECT_TRUE(Validate(clean.result).ok()) << Validate(clean.result);
}

TEST(Cleaning, AnIslandInADroppedHoleIsDroppedAndCountsForTheBody) {
  // A single inside node in the middle of a small hole.
  const auto island = [](int x, int y) {
    return x == 32 && y == 32 ? -1.0 : Holed{32, 32, 1.36}(x, y);
  };
  const Particles particles = At({{24, 32}, {32, 32}});
  ReconstructionParameters parameters = Plain(false);
  parameters.spacing = 2;
  parameters.cell_size = 0.5;
  Stages unclean;
  unclean.RunOn(island, kLow, kHigh, particles, parameters);
  ASSERT_EQ(unclean.topology.RingCount(), 3u);
  parameters.clean = true;
  Stages clean;
  clean.RunOn(island, kLow, kHigh, particles, parameters);
  EXPECT_EQ(clean.topology.RingCount(), 1u);
  EXPECT_EQ(clean.topology.dropped_holes, 1u);
  EXPECT_EQ(clean.topology.particle_count, (std::vector<std::uint64_t>{2}));
  EXPECT_TRUE(Validate(clean.result).ok()) << Validate(clean.result);
}

TEST(Cleaning, AnIslandInALargeHoleStaysAndTheHoleToo) {
  const auto island = [](int x, int y) {
    return std::min(Holed{32, 32, 7}(x, y), Circle(x, y, 32, 32, 3));
  };
  Stages clean;
  clean.RunOn(island, kLow, kHigh, At({{22, 32}, {32, 32}, {33, 32}}), Plain(true));
  ASSERT_EQ(clean.topology.RingCount(), 3u);
  std::vector<std::uint64_t> counts = clean.topology.particle_count;
  std::sort(counts.begin(), counts.end());
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{0, 1, 2}));
}

TEST(Cleaning, EveryParticleOfSeparateBodiesIsCountedForItsOwn) {
  Particles particles = support::Disc(6);
  const std::size_t disc = particles.size();
  particles.Add(support::Lattice(5, 4, 40, 10));
  particles.Add(-40, 0);
  Stages stages;
  stages.Run(particles, {.spacing = 1.0});
  std::vector<std::uint64_t> counts = stages.topology.particle_count;
  std::sort(counts.begin(), counts.end());
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{1, 20, disc}));
}

// A body of radius 13 with a void of radius 10, an island of `island` in it, and a drop of radius
// 2.5 beside it. Areas: 531 (217 of it fluid), the island's own, 20.
auto BodyIslandAndDrop(double island) {
  return [=](int x, int y) {
    return std::min({std::max(Circle(x, y, 24, 24, 13), -Circle(x, y, 24, 24, 10)),
                     Circle(x, y, 24, 24, island), Circle(x, y, 48, 48, 2.5)});
  };
}

TEST(Cleaning, SprayIsDroppedByAreaWithOrWithoutCleaningAndCounted) {
  for (const bool clean : {false, true}) {
    for (const double spacing : {1.0, 2.0}) {
      // In squared spacings; the drop has 20 squared cells, the island 50.
      for (const auto& [min_area, dropped] :
           {std::pair(0.0, 0u), {15.0, 0u}, {25.0, 1u}, {60.0, 2u}, {400.0, 2u}, {600.0, 3u}}) {
        ReconstructionParameters parameters = Plain(clean);
        parameters.spacing = spacing;
        parameters.cell_size = 1 / spacing;
        parameters.min_component_area = min_area / (spacing * spacing);
        Stages stages;
        stages.RunOn(BodyIslandAndDrop(4), kLow, kHigh, At({{12, 24}, {24, 24}, {48, 48}}),
                     parameters);
        EXPECT_EQ(stages.topology.dropped_spray, dropped) << min_area;
        // Body and hole, island, drop.
        EXPECT_EQ(stages.topology.RingCount(), dropped == 3 ? 0u : 4u - dropped);
        EXPECT_EQ(stages.topology.dropped_components, 0u);
        EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
      }
    }
  }
}

TEST(Cleaning, SprayIsDroppedByParticlesAndIslandsCountForWhatHoldsThem) {
  // Two particles in the body, three in its island, one in the drop.
  const Particles particles = At({{12, 24}, {36, 24}, {23, 24}, {24, 24}, {25, 24}, {48, 48}});
  for (const auto& [min_particles, dropped] : {std::pair(1u, 0u), {2u, 1u}, {3u, 1u}, {4u, 2u}}) {
    ReconstructionParameters parameters = Plain(true);
    parameters.min_component_particles = min_particles;
    Stages stages;
    stages.RunOn(BodyIslandAndDrop(4), kLow, kHigh, particles, parameters);
    EXPECT_EQ(stages.topology.dropped_spray, dropped) << min_particles;
    EXPECT_EQ(stages.topology.RingCount(), 4u - dropped);
    EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
  }
}

TEST(Cleaning, WhatLiesInDroppedSprayGoesWithItAndItsNodesAreOutside) {
  // Nested rings; the outer ones enclose five particles. A separate body has six.
  const auto nested = [](int x, int y) {
    return std::min({std::max(Circle(x, y, 20, 20, 13), -Circle(x, y, 20, 20, 10)),
                     std::max(Circle(x, y, 20, 20, 8), -Circle(x, y, 20, 20, 5)),
                     Circle(x, y, 20, 20, 3), Circle(x, y, 50, 50, 8)});
  };
  const Particles particles = At({{8, 20},
                                  {31, 20},
                                  {14, 20},
                                  {20, 20},
                                  {21, 20},
                                  {46, 50},
                                  {47, 50},
                                  {48, 50},
                                  {49, 50},
                                  {50, 50},
                                  {51, 50}});
  ReconstructionParameters parameters = Plain(false);
  parameters.min_component_particles = 6;
  Stages stages;
  stages.RunOn(nested, kLow, kHigh, particles, parameters);
  EXPECT_EQ(stages.topology.dropped_spray, 3u);
  EXPECT_EQ(stages.topology.particle_count, (std::vector<std::uint64_t>{6}));
  Stages body;
  body.RunOn([](int x, int y) { return Circle(x, y, 50, 50, 8); }, kLow, kHigh, particles,
             Plain(false));
  EXPECT_EQ(stages.result.rings.points, body.result.rings.points);
  EXPECT_EQ(stages.result.mesh, body.result.mesh);
  for (std::size_t tile = 0; tile < body.crossings.tiles.size(); ++tile) {
    EXPECT_EQ(stages.crossings.tiles[tile].inside, body.crossings.tiles[tile].inside);
    EXPECT_EQ(stages.crossings.interior[tile], body.crossings.interior[tile]);
  }
  // If the limit is one lower, the outermost ring stays, and the rings inside it are judged
  // separately.
  parameters.min_component_particles = 5;
  Stages judged;
  judged.RunOn(nested, kLow, kHigh, particles, parameters);
  EXPECT_EQ(judged.topology.dropped_spray, 2u);
  EXPECT_EQ(judged.topology.RingCount(), 3u);
}

TEST(Cleaning, SprayOfRandomScenesIsWhatABruteForceNestingSays) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const auto noise = [=](int x, int y) {
      if (x <= 0 || y <= 0 || x >= 63 || y >= 63) return 1.0;
      support::Random random(seed * 1'000'003 + static_cast<std::uint64_t>(y / 3 * 64 + x / 3));
      return random.Uniform(-1, 1) + 0.1 * static_cast<double>(seed % 3) - 0.1;
    };
    support::Random random(seed);
    Particles particles;
    for (int k = 0; k < 60; ++k) particles.Add(random.Uniform(1, 62), random.Uniform(1, 62));
    Stages all;
    all.RunOn(noise, kLow, kHigh, particles, Plain(false));
    ReconstructionParameters parameters = Plain(false);
    parameters.min_component_particles = 1 + seed % 3;
    parameters.min_component_area = 12;
    Stages stages;
    stages.RunOn(noise, kLow, kHigh, particles, parameters);
    // A ring lies in another if its first point does, by the crossings of a ray.
    const Rings& rings = all.result.rings;
    const auto lies_in = [&](std::size_t inner, std::size_t outer) {
      const double px = rings.RingPoints(inner)[0], py = rings.RingPoints(inner)[1];
      const auto points = rings.RingPoints(outer);
      bool inside = inner == outer;
      for (std::size_t a = 0, n = points.size() / 2; a < n && inner != outer; ++a) {
        const std::size_t b = (a + 1) % n;
        const double ay = points[2 * a + 1], by = points[2 * b + 1];
        if ((ay > py) == (by > py)) continue;
        const double x = points[2 * a] + (py - ay) / (by - ay) * (points[2 * b] - points[2 * a]);
        if (x > px) inside = !inside;
      }
      return inside;
    };
    std::vector<std::size_t> spray;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      if (rings.outer_of[ring] != kNoRing) continue;
      std::uint64_t enclosed = 0;
      for (std::size_t other = 0; other < rings.RingCount(); ++other) {
        if (lies_in(other, ring)) enclosed += rings.measures[other].particle_count;
      }
      if (enclosed < parameters.min_component_particles || rings.measures[ring].area < 12) {
        spray.push_back(ring);
      }
    }
    std::uint64_t dropped = 0;
    std::size_t kept = 0;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const bool drop = std::any_of(spray.begin(), spray.end(),
                                    [&](std::size_t outer) { return lies_in(ring, outer); });
      dropped += drop && rings.outer_of[ring] == kNoRing;
      kept += !drop;
    }
    EXPECT_GT(dropped, 0u);
    EXPECT_EQ(stages.topology.dropped_spray, dropped);
    EXPECT_EQ(stages.topology.RingCount(), kept);
    EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
  }
}

}  // namespace
}  // namespace partiemc
