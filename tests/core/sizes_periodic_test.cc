// Particles of different sizes in periodic boxes: a body has the same outline across a face and in
// the middle of the box, and every result keeps its guarantees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/sized_scenes.h"
#include "support/tracked_scene.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;
using testing::ElementsAre;

ReconstructionParameters SizedIn(const PeriodicBox& box, Fill fill = Fill::kGreedy) {
  return {.fill = fill, .spacing = 1.0, .sizes = Sizes::kOwn, .box = box};
}

const ReconstructionParameters kSizedOpen{.spacing = 1.0, .sizes = Sizes::kOwn};

// Sizes of a ratio of 1:3.
double DrawOneToThree(Random& random, double, double) { return random.Uniform(.5, 1.5); }

// A disc of particles at rest around the origin.
const Particles& SizedDisc() {
  static const Particles disc = [] {
    Random random(11);
    return support::Filled(support::DiscBody(9), random, DrawOneToThree);
  }();
  return disc;
}

void AddSized(Particles& scene, const Particles& body) {
  scene.Add(body);
  scene.volumes.insert(scene.volumes.end(), body.volumes.begin(), body.volumes.end());
}

double SumOfVolumes(const Particles& particles) {
  return std::accumulate(particles.volumes.begin(), particles.volumes.end(), 0.0);
}

constexpr double kSizedBoxWidth = 60, kSizedBoxHeight = 60;

// A layer of mixed sizes below a wave that repeats after kSizedBoxWidth, moved by `phase`.
Particles SizedWave(double phase = 0) {
  static const Particles wave = [] {
    Random random(5);
    Particles particles;
    // Rows of random sizes, each scaled to the width of the box.
    for (double y = 10; y < 24;) {
      const double row = random.Uniform(.5, 1.5);
      std::vector<double> sizes;
      double width = 0;
      while (width < kSizedBoxWidth) {
        sizes.push_back(row * random.Uniform(.8, 1.25));
        width += sizes.back();
      }
      double x = 0;
      for (const double drawn : sizes) {
        const double size = drawn * kSizedBoxWidth / width;
        const double top = 20 + 3 * std::sin(2 * M_PI * x / kSizedBoxWidth);
        if (y < top) {
          particles.Add(x + size / 2, y + random.Uniform(-.1, .1));
          particles.volumes.push_back(static_cast<float>(size * row));
        }
        x += size;
      }
      y += row;
    }
    return particles;
  }();
  return support::Shifted(wave, phase, 0);
}

// Area, perimeter and particles of each ring, ascending.
struct RingSize {
  double area, perimeter;
  std::uint64_t particles;
  friend auto operator<=>(const RingSize&, const RingSize&) = default;
};

void ExpectSameRings(const Rings& rings, const Rings& expected, double tolerance) {
  const auto sizes_of = [](const Rings& of) {
    std::vector<RingSize> sizes;
    for (const RingMeasures& ring : of.measures) {
      sizes.push_back({ring.area, ring.perimeter, ring.particle_count});
    }
    std::ranges::sort(sizes);
    return sizes;
  };
  const auto sizes = sizes_of(rings), wanted = sizes_of(expected);
  ASSERT_EQ(sizes.size(), wanted.size());
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    EXPECT_NEAR(sizes[k].area, wanted[k].area, tolerance * std::abs(wanted[k].area));
    EXPECT_NEAR(sizes[k].perimeter, wanted[k].perimeter, tolerance * wanted[k].perimeter);
    EXPECT_EQ(sizes[k].particles, wanted[k].particles);
  }
}

TEST(SizesPeriodic, BodyAcrossEdgeAndCornerIsTheBodyInTheMiddle) {
  PeriodicBox box = BoxOf(48, 40);
  const Result middle = ReconstructOnce(kSizedOpen, support::Shifted(SizedDisc(), 24, 20));
  ASSERT_EQ(middle.rings.RingCount(), 1u);
  for (const auto& [x, y] : {std::pair(24, 20), {0, 20}, {24, 0}, {0, 0}, {47, 39}, {44, 3}}) {
    SCOPED_TRACE(testing::Message() << x << " " << y);
    const Particles disc = Wrapped(support::Shifted(SizedDisc(), x, y), box);
    const Result across = ReconstructOnce(SizedIn(box), disc);
    ExpectValid(across, Fill::kGreedy);
    ExpectSameRings(across.rings, middle.rings, 1e-6);
    const RingMeasures &here = across.rings.measures[0], &there = middle.rings.measures[0];
    EXPECT_NEAR(std::remainder(here.centroid_x - there.centroid_x + 24 - x, 48), 0, 1e-6);
    EXPECT_NEAR(std::remainder(here.centroid_y - there.centroid_y + 20 - y, 40), 0, 1e-6);
    box.wraps = true;
    const Result wrapped = ReconstructOnce(SizedIn(box), disc);
    box.wraps = false;
    ExpectValid(wrapped, Fill::kGreedy);
    EXPECT_NEAR(wrapped.statistics.area, middle.statistics.area, 1e-6 * middle.statistics.area);
    EXPECT_NEAR(wrapped.statistics.perimeter, middle.statistics.perimeter,
                1e-6 * middle.statistics.perimeter);
    EXPECT_EQ(ParticlesOf(wrapped.rings), SizedDisc().size());
  }
}

TEST(SizesPeriodic, BodyInTheMiddleKeepsItsBits) {
  const Particles disc = support::Shifted(SizedDisc(), 25.3, 24.1);
  EXPECT_EQ(ReconstructOnce(SizedIn(BoxOf(50, 50)), disc), ReconstructOnce(kSizedOpen, disc));
}

// Two particles within the sum of their kernels, but beyond twice the kernel radius of the spacing.
TEST(SizesPeriodic, LargeParticlesActAcrossTheFace) {
  const PeriodicBox box = BoxOf(60, 60);
  for (const double gap : {5.5, 6.5, 7.5}) {
    SCOPED_TRACE(gap);
    Particles pair;
    pair.Add(-gap / 2, 30);
    pair.Add(gap / 2, 30);
    pair.volumes = {9, 9};
    // In the middle of a large box: without a box, outlines of large particles have fewer vertices.
    const Result whole =
        ReconstructOnce(SizedIn(BoxOf(600, 600)), support::Shifted(pair, 300, 300));
    ExpectSameRings(ReconstructOnce(SizedIn(box), Wrapped(pair, box)).rings, whole.rings, 1e-6);
  }
}

TEST(SizesPeriodic, SpacingIsEstimatedFromTheSizes) {
  const PeriodicBox box = BoxOf(48, 40);
  ReconstructionParameters open = kSizedOpen, boxed = SizedIn(box);
  open.spacing.reset();
  boxed.spacing.reset();
  const Result expected = ReconstructOnce(open, SizedDisc());
  const Result across = ReconstructOnce(boxed, Wrapped(SizedDisc(), box));
  EXPECT_EQ(across.statistics.spacing, expected.statistics.spacing);
  // The length is no whole number of cells.
  EXPECT_NEAR(across.statistics.area, expected.statistics.area, 1e-3 * expected.statistics.area);
}

// A layer is cut at the faces. It has the area of its particles, wherever the face lies.
TEST(SizesPeriodic, LayerIsCutAnywhereWithItsArea) {
  const double volume = SumOfVolumes(SizedWave());
  std::optional<double> perimeter;
  for (const double x : {0.0, 7.0, 20.0, 31.0, -12.0}) {
    SCOPED_TRACE(x);
    for (const bool wraps : {false, true}) {
      PeriodicBox box = BoxOf(kSizedBoxWidth, kSizedBoxHeight, x, 0);
      box.wraps = wraps;
      const Result result = ReconstructOnce(SizedIn(box), Wrapped(SizedWave(), box));
      ExpectValid(result, Fill::kGreedy);
      ASSERT_EQ(result.rings.RingCount(), 1u);
      EXPECT_EQ(result.statistics.cut_bodies, 1u);
      EXPECT_EQ(result.rings.measures[0].particle_count, SizedWave().size());
      EXPECT_NEAR(result.statistics.area, volume, 1e-6 * volume);
      if (!perimeter) perimeter = result.statistics.perimeter;
      EXPECT_NEAR(result.statistics.perimeter, *perimeter, 1e-4 * *perimeter);
    }
  }
}

TEST(SizesPeriodic, LayerContinuesAtTheOppositeFace) {
  const Result result =
      ReconstructOnce(SizedIn(BoxOf(kSizedBoxWidth, kSizedBoxHeight)), SizedWave(11));
  std::vector<double> left, right;
  for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
    const double x = result.rings.points[2 * k], y = result.rings.points[2 * k + 1];
    if (std::abs(x) < 1e-6) left.push_back(y);
    if (std::abs(x - kSizedBoxWidth) < 1e-6) right.push_back(y);
  }
  std::ranges::sort(left);
  std::ranges::sort(right);
  ASSERT_EQ(left.size(), 2u);
  ASSERT_EQ(right.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(left[k], right[k], 1e-5);
}

// A drop in one cluster with a layer is whole, also across the face.
TEST(SizesPeriodic, DropNearALayerIsWhole) {
  const PeriodicBox box = BoxOf(kSizedBoxWidth, 80);
  std::optional<double> area;
  for (const double x : {0.0, 2.0, 58.0, 30.0}) {
    SCOPED_TRACE(x);
    Particles scene = SizedWave();
    AddSized(scene, support::Shifted(SizedDisc(), x, 40));
    const Result result = ReconstructOnce(SizedIn(box), Wrapped(scene, box));
    ExpectValid(result, Fill::kGreedy);
    ASSERT_EQ(result.rings.RingCount(), 2u);
    EXPECT_EQ(result.statistics.cut_bodies, 1u);
    const RingMeasures& drop = *std::ranges::find(result.rings.measures, SizedDisc().size(),
                                                  &RingMeasures::particle_count);
    if (!area) area = drop.area;
    EXPECT_NEAR(drop.area, *area, 1e-5 * *area);
    EXPECT_NEAR(drop.centroid_x, x, .1);
  }
}

// Spray is measured by the areas of its particles, not by the spacing.
TEST(SizesPeriodic, SprayCountsOwnAreas) {
  const PeriodicBox box = BoxOf(kSizedBoxWidth, 80);
  Particles scene = SizedWave(), drops;
  for (const auto& [x, size] : {std::pair(10.0, .5), {40.0, 1.4}}) {
    for (Particles* particles : {&scene, &drops}) {
      particles->Add(x, 32);
      particles->volumes.push_back(static_cast<float>(size * size));
    }
  }
  ReconstructionParameters parameters = SizedIn(box);
  EXPECT_EQ(ReconstructOnce(parameters, scene).rings.RingCount(), 3u);
  parameters.min_component_area = .9;
  const Result kept = ReconstructOnce(parameters, scene);
  EXPECT_EQ(kept.rings.RingCount(), 2u);
  EXPECT_EQ(kept.statistics.dropped_spray, 1u);
  EXPECT_EQ(ParticlesOf(kept.rings), scene.size() - 1);
  // Without a layer, nothing is cut, and the box keeps and drops the same drops.
  EXPECT_EQ(ReconstructOnce(parameters, drops).rings.RingCount(), 1u);
}

class SizedDrift : public testing::TestWithParam<support::Known> {
 protected:
  void Drift(bool wraps);
};
INSTANTIATE_TEST_SUITE_P(With, SizedDrift,
                         testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                         support::kBoth),
                         testing::PrintToStringParamName());

TEST_P(SizedDrift, BodiesKeepTheirIdentities) { Drift(false); }
TEST_P(SizedDrift, WrappedBodiesKeepTheirIdentities) { Drift(true); }

// A layer and a drop drift through the box, whose length is no whole number of cells.
void SizedDrift::Drift(bool wraps) {
  PeriodicBox box = BoxOf(kSizedBoxWidth, 80.3);
  box.wraps = wraps;
  RingStream stream(SizedIn(box));
  for (int frame = 0; frame < 80; ++frame) {
    SCOPED_TRACE(frame);
    Particles scene = SizedWave(.9 * frame);
    AddSized(scene, support::Shifted(SizedDisc(), 5 + .9 * frame, 48));
    scene = Wrapped(scene, box);
    for (std::size_t k = 0; k < scene.size(); ++k) {
      if (GetParam().ids) scene.ids.push_back(3 * k + 7);
      if (GetParam().velocities) scene.velocities.insert(scene.velocities.end(), {.9f, 0});
    }
    scene.time = frame;
    const Rings& rings = stream.Next(scene);
    ASSERT_GE(rings.RingCount(), 2u);
    std::vector<std::size_t> by_area(rings.RingCount());
    std::iota(by_area.begin(), by_area.end(), std::size_t{0});
    std::ranges::sort(by_area, std::greater(),
                      [&](std::size_t k) { return rings.measures[k].area; });
    for (std::size_t k = 0; k < by_area.size(); ++k) {
      EXPECT_EQ(rings.measures[by_area[k]].identity, k < 2 ? k + 1 : 0);
      if (frame > 0 && k < 2) {
        EXPECT_THAT(stream.rings().ParentsOf(by_area[k]), ElementsAre(k + 1));
      }
    }
  }
}

// The box of each frame stretches by up to 6 %, and volumes with it.
TEST(SizesPeriodic, BodiesKeepIdentitiesAndAreasInABoxThatChanges) {
  for (const bool wraps : {false, true}) {
    SCOPED_TRACE(wraps);
    PeriodicBox box = BoxOf(kSizedBoxWidth, 80);
    box.wraps = wraps;
    RingStream stream(SizedIn(box));
    Particles scene = SizedWave();
    AddSized(scene, support::Shifted(SizedDisc(), 0, 48));
    for (int frame = 0; frame < 40; ++frame) {
      SCOPED_TRACE(frame);
      const double x = 1 + .06 * std::sin(.2 * frame), y = 1 + .04 * std::sin(.3 * frame);
      Particles now = scene;
      for (std::size_t k = 0; k < now.xy.size(); ++k) now.xy[k] *= k % 2 == 0 ? x : y;
      for (float& volume : now.volumes) volume *= static_cast<float>(x * y);
      const PeriodicBox of_frame = BoxOf(kSizedBoxWidth * x, 80 * y);
      now = Wrapped(now, of_frame);
      now.time = frame;
      Frame view = now.AsFrame();
      view.box = of_frame;
      const Rings& rings = stream.Next(view);
      ExpectValid(stream.result(), Fill::kGreedy);
      std::vector<std::uint64_t> identities;
      for (const RingMeasures& ring : rings.measures) {
        if (ring.identity != 0) identities.push_back(ring.identity);
      }
      std::ranges::sort(identities);
      EXPECT_THAT(identities, ElementsAre(1, 2));
      EXPECT_EQ(ParticlesOf(rings), scene.size());
      const double volume = SumOfVolumes(now);
      EXPECT_NEAR(stream.result().statistics.area, volume, 3e-3 * volume);
    }
  }
}

// A random frame in a random box, and parameters for it.
struct RandomBox {
  Particles particles;
  ReconstructionParameters parameters;
};

RandomBox RandomSizedFrame(std::uint64_t seed) {
  Random random(seed);
  RandomBox frame;
  ReconstructionParameters& parameters = frame.parameters;
  parameters = SizedIn({}, AllFills()[seed % AllFills().size()]);
  if (seed % 5 == 0) parameters.placement = Placement::kMarchingSquares;
  if (seed % 7 == 0) parameters.placement = Placement::kQef;
  if (seed % 11 == 0) parameters.isovalue = .6;
  if (seed % 4 == 1) parameters.cell_size = seed % 8 == 1 ? .5 : 1.6;
  if (seed % 6 == 1) parameters.kernel_radius = random.Uniform(1.5, 4);
  if (seed % 10 == 3) parameters.min_component_area = 2;
  const double ratio = std::array{1.5, 3.0, 3.0, 10.0}[random.Below(4)];
  const double most = std::min(10.0, 32 * parameters.cell_size / parameters.kernel_radius);
  const double largest = std::min(most, std::pow(ratio, random.Unit()));
  const double least = 4 * parameters.kernel_radius * std::max(1.0, largest);
  PeriodicBox box = BoxOf(least * random.Uniform(1.001, 2), least * random.Uniform(1.001, 2),
                          random.Uniform(-20, 20), random.Uniform(-20, 20));
  box.wraps = seed % 3 == 0;
  if (seed % 13 == 0) box.axes[seed % 2].reset();
  parameters.box = box;
  // Particles until their areas are this share of the box.
  const double width = box.axes[0] ? box.axes[0]->length : least;
  const double height = box.axes[1] ? box.axes[1]->length : least;
  double left = random.Uniform(.02, 1.2) * width * height;
  while (left > 0) {
    const double size = largest * std::pow(ratio, -random.Unit());
    frame.particles.Add((box.axes[0] ? box.axes[0]->origin : 0) + random.Uniform(0, width),
                        (box.axes[1] ? box.axes[1]->origin : 0) + random.Uniform(0, height));
    frame.particles.volumes.push_back(static_cast<float>(size * size));
    left -= size * size;
  }
  return frame;
}

TEST(SizesPeriodic, RandomFramesKeepTheGuarantees) {
  std::uint64_t cut = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(400u); ++seed) {
    SCOPED_TRACE(seed);
    const auto& [particles, parameters] = RandomSizedFrame(seed);
    const Result result = ReconstructOnce(parameters, particles);
    ExpectValid(result, parameters.fill);
    cut += result.statistics.cut_bodies;
  }
  EXPECT_GT(cut, support::Tries(400u) / 4);
}

TEST(SizesPeriodic, AnyNumberOfThreadsGivesTheSameBits) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  for (const bool wraps : {false, true}) {
    PeriodicBox box = BoxOf(kSizedBoxWidth, 80);
    box.wraps = wraps;
    Particles scene = SizedWave();
    AddSized(scene, support::Shifted(SizedDisc(), 0, 48));
    scene = Wrapped(scene, box);
    std::vector<Result> results;
    for (const unsigned threads : {1u, 2u, 7u}) {
      Arena arena(threads);
      arena.Execute([&] { results.push_back(ReconstructOnce(SizedIn(box), scene)); });
    }
    EXPECT_EQ(results[1], results[0]);
    EXPECT_EQ(results[2], results[0]);
  }
}

// Sums of single precision depend on the order of the particles.
TEST(SizesPeriodic, OrderOfParticlesChangesNothing) {
  Random random(3);
  const PeriodicBox box = BoxOf(kSizedBoxWidth, 80);
  Particles scene = SizedWave();
  AddSized(scene, support::Shifted(SizedDisc(), 0, 48));
  scene = Wrapped(scene, box);
  const Result expected = ReconstructOnce(SizedIn(box), scene);
  for (int k = 0; k < 5; ++k) {
    const Result result = ReconstructOnce(SizedIn(box), support::Permuted(scene, random));
    ExpectSameRings(result.rings, expected.rings, 1e-5);
  }
}

TEST(SizesPeriodic, BoxesBelowFourKernelRadiiOfTheLargestParticleAreRefused) {
  Particles scene = SizedDisc();
  scene.volumes[7] = 9;  // A kernel radius of 9.
  ReconstructOnce(SizedIn(BoxOf(36.1, 40)), scene);
  const auto violation = RefusalOf(SizedIn(BoxOf(40, 35.9)), scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, kReasonOutOfRange);
  EXPECT_EQ(violation->field, "parameters.box.y.length");
  EXPECT_THAT(violation->rule, testing::HasSubstr("for the largest particle"));
  Frame frame = scene.AsFrame();
  frame.box = BoxOf(35.9, 40);
  State state;
  Workspace workspace;
  Result result;
  const auto of_frame = FindViolation(
      Reconstructor::Create(SizedIn(BoxOf(40, 40)))->Reconstruct(frame, state, workspace, result));
  ASSERT_TRUE(of_frame.has_value());
  EXPECT_EQ(of_frame->field, "box.x.length");
  // Sizes below the spacing allow no smaller box.
  scene.volumes.assign(scene.size(), .25f);
  ReconstructOnce(SizedIn(BoxOf(12, 12)), scene);
  EXPECT_EQ(FindViolation(Validate(SizedIn(BoxOf(11.9, 12))))->field, "parameters.box.x.length");
}

// Copies of particles have larger numbers, but the error names a given one.
TEST(SizesPeriodic, ErrorsNameGivenParticles) {
  Particles scene = Wrapped(SizedWave(), BoxOf(kSizedBoxWidth, kSizedBoxHeight));
  scene.volumes[3] = 121;
  const auto violation = RefusalOf(SizedIn(BoxOf(kSizedBoxWidth, kSizedBoxHeight)), scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "volumes[3]");
  scene.volumes.clear();
  EXPECT_EQ(RefusalOf(SizedIn(BoxOf(kSizedBoxWidth, kSizedBoxHeight)), scene)->field, "volumes");
}

TEST(SizesPeriodic, EmptyFramesPass) {
  RingStream stream(SizedIn(BoxOf(40, 40)));
  EXPECT_EQ(stream.Next(Particles()).RingCount(), 0u);
  Particles lone;
  lone.Add(40, 0);
  lone.volumes.push_back(2.25f);
  EXPECT_EQ(stream.Next(lone).RingCount(), 1u);
}

}  // namespace
}  // namespace partiemc
