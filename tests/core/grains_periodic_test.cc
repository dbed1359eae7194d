// Grains in periodic boxes: a packing has the same outline across a face and in the middle.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/grain_scenes.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;

ReconstructionParameters GrainsIn(const PeriodicBox& box) {
  return {.spacing = 1.0, .sizes = Sizes::kOwn, .boundary = Boundary::kGrains, .box = box};
}

double DrawGrain(Random& random) { return random.Uniform(1, 3); }

const Particles& Heap() {
  static const Particles heap = [] {
    Random random(4);
    return support::GrainHeap(random, 60, DrawGrain);
  }();
  return heap;
}

TEST(GrainsPeriodic, HeapAcrossEdgeAndCornerIsTheHeapInTheMiddle) {
  const PeriodicBox box = BoxOf(50, 44);
  ReconstructionParameters open = GrainsIn(box);
  open.box.reset();
  const Result middle = ReconstructOnce(open, support::Shifted(Heap(), 25, 22));
  for (const auto& [x, y] : {std::pair(25, 22), {0, 22}, {25, 0}, {0, 0}, {49, 43}, {46, 3}}) {
    SCOPED_TRACE(testing::Message() << x << " " << y);
    for (const bool wraps : {false, true}) {
      PeriodicBox across = box;
      across.wraps = wraps;
      const Result result =
          ReconstructOnce(GrainsIn(across), Wrapped(support::Shifted(Heap(), x, y), box));
      ExpectValid(result, Fill::kGreedy);
      if (!wraps) {
        EXPECT_EQ(result.rings.RingCount(), middle.rings.RingCount());
      }
      EXPECT_EQ(ParticlesOf(result.rings), Heap().size());
      EXPECT_NEAR(result.statistics.area, middle.statistics.area, 1e-6 * middle.statistics.area);
      EXPECT_NEAR(result.statistics.perimeter, middle.statistics.perimeter,
                  1e-6 * middle.statistics.perimeter);
    }
  }
}

TEST(GrainsPeriodic, SprayKeepsEachGrain) {
  const PeriodicBox box = BoxOf(100, 90, -7, 3);
  Random random(9);
  // The spray is smaller than the box, so that grains do not overlap after wrapping.
  const Particles spray = support::GrainSpray(random, 40, DrawGrain);
  const auto [low, high] = std::ranges::minmax(spray.xy);
  ASSERT_LT(high - low, 80);
  const Particles moved = Wrapped(support::Shifted(spray, -7.3, 3.4), box);
  const Result result = ReconstructOnce(GrainsIn(box), moved);
  ExpectValid(result, Fill::kGreedy);
  EXPECT_EQ(result.rings.RingCount(), spray.size());
  double discs = 0;
  for (const float volume : spray.volumes) discs += std::numbers::pi / 4 * volume;
  EXPECT_NEAR(result.statistics.area, discs, .05 * discs);
}

// A floor of grains through the whole box is cut at the faces. Its outline is the same wherever
// the face lies.
TEST(GrainsPeriodic, FloorIsCutAnywhere) {
  Particles floor;
  for (int row = 0; row < 4; ++row) {
    for (int k = 0; k < 20; ++k) {
      floor.Add(2 * k + (row % 2 == 0 ? 0 : 1), 10 + row * std::numbers::sqrt3);
      floor.volumes.push_back(k % 3 == 0 ? 4 : 3.6f);
    }
  }
  double area = 0, perimeter = 0;
  for (const double x : {0.0, 7.0, 31.0, -12.0}) {
    SCOPED_TRACE(x);
    const PeriodicBox box = BoxOf(40, 40, x, 0);
    const Result result = ReconstructOnce(GrainsIn(box), Wrapped(floor, box));
    ExpectValid(result, Fill::kGreedy);
    EXPECT_EQ(result.statistics.cut_bodies, 1u);
    EXPECT_EQ(ParticlesOf(result.rings), floor.size());
    if (x == 0) area = result.statistics.area, perimeter = result.statistics.perimeter;
    EXPECT_NEAR(result.statistics.area, area, 1e-6 * area);
    EXPECT_NEAR(result.statistics.perimeter, perimeter, 1e-6 * perimeter);
  }
}

TEST(GrainsPeriodic, GrainsKeepTheirIdentitiesAcrossTheFaces) {
  const PeriodicBox box = BoxOf(50.3, 44.7);
  RingStream stream(GrainsIn(box));
  std::vector<std::uint64_t> first;
  for (int frame = 0; frame < 80; ++frame) {
    SCOPED_TRACE(frame);
    Particles scene = support::Shifted(Heap(), .7 * frame, .3 * frame);
    scene.Add(25 + .7 * frame, 22 + .3 * frame);
    scene.volumes.push_back(4);
    scene = Wrapped(scene, box);
    scene.time = frame;
    const Rings& rings = stream.Next(scene);
    std::vector<std::uint64_t> identities;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      if (rings.outer_of[ring] == kNoRing) identities.push_back(rings.measures[ring].identity);
    }
    std::ranges::sort(identities);
    if (frame == 0) first = identities;
    ASSERT_FALSE(identities.empty());
    EXPECT_GT(identities.front(), 0u);
    EXPECT_EQ(identities, first);
  }
}

TEST(GrainsPeriodic, RandomFramesKeepTheGuarantees) {
  std::uint64_t cut = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(300u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const double ratio = std::array{1.0, 1.5, 3.0, 8.0}[seed % 4];
    const double least = 6.4 * ratio;
    PeriodicBox box = BoxOf(least * random.Uniform(1.001, 3), least * random.Uniform(1.001, 3),
                            random.Uniform(-20, 20), random.Uniform(-20, 20));
    box.wraps = seed % 3 == 0;
    ReconstructionParameters parameters = GrainsIn(box);
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (seed % 5 == 0) parameters.placement = Placement::kMarchingSquares;
    if (seed % 7 == 0) parameters.placement = Placement::kQef;
    const auto& [x, y] = std::pair(*box.axes[0], *box.axes[1]);
    Particles grains;
    for (double left = random.Uniform(.02, 1) * x.length * y.length; left > 0;) {
      const double diameter = random.Uniform(1, ratio);
      grains.Add(x.origin + random.Uniform(0, x.length), y.origin + random.Uniform(0, y.length));
      grains.volumes.push_back(static_cast<float>(diameter * diameter));
      left -= diameter * diameter;
    }
    const Result result = ReconstructOnce(parameters, grains);
    ExpectValid(result, parameters.fill);
    EXPECT_EQ(ParticlesOf(result.rings), grains.size());  // No grain is lost.
    cut += result.statistics.cut_bodies;
  }
  EXPECT_GT(cut, support::Tries(300u) / 4);
}

TEST(GrainsPeriodic, AnyNumberOfThreadsGivesTheSameBits) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  const PeriodicBox box = BoxOf(50, 44);
  const Particles heap = Wrapped(Heap(), box);
  std::vector<Result> results;
  for (const unsigned threads : {1u, 2u, 7u}) {
    Arena arena(threads);
    arena.Execute([&] { results.push_back(ReconstructOnce(GrainsIn(box), heap)); });
  }
  EXPECT_EQ(results[1], results[0]);
  EXPECT_EQ(results[2], results[0]);
}

// Kernels of grains are smaller than kernels of the bulk.
TEST(GrainsPeriodic, BoxesAreAtLeastFourKernelRadiiOfTheLargestGrain) {
  EXPECT_TRUE(Validate(GrainsIn(BoxOf(6.4, 6.4))).ok());
  EXPECT_EQ(FindViolation(Validate(GrainsIn(BoxOf(6.39, 7))))->field, "parameters.box.x.length");
  Particles grains;
  for (const double diameter : {1.0, 3.0}) {
    grains.Add(10 * diameter, 5);
    grains.volumes.push_back(static_cast<float>(diameter * diameter));
  }
  ReconstructOnce(GrainsIn(BoxOf(19.3, 30)), grains);
  EXPECT_EQ(RefusalOf(GrainsIn(BoxOf(19.1, 30)), grains)->field, "parameters.box.x.length");
}

}  // namespace
}  // namespace partiemc
