// Bodies that reach their own image in a periodic box are cut at its faces.
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
#include <span>
#include <string>
#include <vector>

#include "core/boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tracked_scene.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RingStream;
using testing::ElementsAre;

constexpr double kBoxWidth = 60, kBoxHeight = 50;

// The particles of a lattice below a wave that repeats after kBoxWidth, above a flat bottom.
Particles Wave(double phase, double amplitude = 4, double noise = 0, std::uint64_t seed = 1) {
  Random random(seed);
  Particles wave;
  for (int i = 0; i < kBoxWidth; ++i) {
    const double top = 20 + amplitude * std::sin(2 * M_PI * (i + phase) / kBoxWidth);
    for (int j = 0; j < top; ++j) {
      const double x = random.Uniform(-noise, noise), y = random.Uniform(-noise, noise);
      wave.Add(i + .5 + x, j + 10 + y);
    }
  }
  return wave;
}

double CutLength(const Rings& rings) {
  double length = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      if (!std::ranges::binary_search(rings.cuts, k)) continue;
      const std::uint32_t next = k + 1 < rings.offsets[ring + 1] ? k + 1 : rings.offsets[ring];
      length += std::hypot(rings.points[2 * next] - rings.points[2 * k],
                           rings.points[2 * next + 1] - rings.points[2 * k + 1]);
    }
  }
  return length;
}

TEST(Percolation, FlatLayerIsCutAtTheFaces) {
  const PeriodicBox box = BoxOf(40, 60);
  for (const Placement placement : AllPlacements()) {
    if (!KeepsGuarantees(placement)) continue;
    for (const Fill fill : AllFills()) {
      SCOPED_TRACE(std::string(Name(placement)) + " " + std::string(Name(fill)));
      const Result result =
          ReconstructOnce(In(box, fill, placement), support::Lattice(40, 8, 0, 20));
      ASSERT_EQ(result.rings.RingCount(), 1u);
      ExpectValid(result, fill);
      const RingMeasures& layer = result.rings.measures[0];
      EXPECT_NEAR(layer.area, 320, placement == Placement::kVirtualPlane ? 1e-8 : 6);
      EXPECT_NEAR(layer.perimeter, 80, 1e-9);
      EXPECT_NEAR(layer.centroid_x, 20, 1e-3);
      EXPECT_NEAR(layer.centroid_y, 23.5, 1e-3);
      EXPECT_EQ(layer.particle_count, 320u);
      EXPECT_EQ(layer.identity, 1u);
      EXPECT_NEAR(CutLength(result.rings), 16, .3);
      EXPECT_EQ(result.statistics.cut_bodies, 1u);
      EXPECT_EQ(result.statistics.particles, 320u);
      for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
        // Lattice nodes lie on the faces, so the faces move a little.
        EXPECT_GE(result.rings.points[2 * k], 0);
        EXPECT_LE(result.rings.points[2 * k], 40 + 1e-8);
      }
    }
  }
}

TEST(Percolation, FullBoxHasNoPerimeter) {
  const Result full = ReconstructOnce(In(BoxOf(40, 30, 3, 4)), support::Lattice(40, 30, 3.5, 4.5));
  ASSERT_EQ(full.rings.RingCount(), 1u);
  ExpectValid(full, Fill::kGreedy);
  EXPECT_EQ(full.rings.PointCount(), 4u);
  EXPECT_THAT(full.rings.cuts, ElementsAre(0, 1, 2, 3));
  EXPECT_NEAR(full.rings.measures[0].area, 1200, 1e-9);
  EXPECT_EQ(full.rings.measures[0].perimeter, 0);
  EXPECT_EQ(full.rings.measures[0].particle_count, 1200u);
}

// Where the face lies does not matter: area and perimeter of a body stay.
TEST(Percolation, FaceMayLieAnywhere) {
  const Particles wave = Wave(0, 4, .2);
  const Result first = ReconstructOnce(In(BoxOf(kBoxWidth, kBoxHeight)), wave);
  ASSERT_EQ(first.rings.RingCount(), 1u);
  EXPECT_NEAR(first.statistics.area, static_cast<double>(wave.size()),
              1e-6 * static_cast<double>(wave.size()));
  for (const double x : {7.0, 20.0, 31.0, 59.0, -12.0}) {
    SCOPED_TRACE(x);
    const PeriodicBox box = BoxOf(kBoxWidth, kBoxHeight, x, 0);
    const Result moved = ReconstructOnce(In(box), Wrapped(wave, box));
    ExpectValid(moved, Fill::kGreedy);
    ASSERT_EQ(moved.rings.RingCount(), 1u);
    EXPECT_NEAR(moved.statistics.area, first.statistics.area, 1e-8 * first.statistics.area);
    EXPECT_NEAR(moved.statistics.perimeter, first.statistics.perimeter,
                1e-3 * first.statistics.perimeter);
  }
}

// Both faces cut the outline at the same height.
TEST(Percolation, OutlineContinuesAtTheOppositeFace) {
  const Result result = ReconstructOnce(In(BoxOf(kBoxWidth, kBoxHeight)), Wave(11, 4, .2));
  std::vector<double> left, right;
  for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
    const double x = result.rings.points[2 * k], y = result.rings.points[2 * k + 1];
    if (x == 0) left.push_back(y);
    if (x == kBoxWidth) right.push_back(y);
  }
  std::ranges::sort(left);
  std::ranges::sort(right);
  ASSERT_EQ(left.size(), 2u);
  ASSERT_EQ(right.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(left[k], right[k], 1e-5);
}

// Bodies near a percolating one, in one cluster with it.
TEST(Percolation, DropAcrossTheFaceIsWhole) {
  const PeriodicBox box = BoxOf(kBoxWidth, 80);
  const auto count = support::Disc(5, 20, 42).size();
  std::optional<double> area;
  for (const double x : {0.0, 2.0, 58.0, 30.0}) {
    SCOPED_TRACE(x);
    Particles scene = Wave(0);
    scene.Add(support::Disc(5, x, 42));  // Five spacings above the wave.
    const Result result = ReconstructOnce(In(box), Wrapped(scene, box));
    ExpectValid(result, Fill::kGreedy);
    ASSERT_EQ(result.rings.RingCount(), 2u);
    EXPECT_EQ(result.statistics.cut_bodies, 1u);
    const bool first_is_drop = result.rings.measures[0].area < 200;
    const RingMeasures& drop = result.rings.measures[first_is_drop ? 0 : 1];
    if (!area) area = drop.area;
    EXPECT_NEAR(drop.area, *area, 1e-5 * *area);
    EXPECT_NEAR(drop.area, static_cast<double>(count), .03 * *area);
    EXPECT_EQ(drop.particle_count, count);
    EXPECT_NEAR(drop.centroid_x, x, .01);
    EXPECT_EQ(result.rings.measures[first_is_drop ? 1 : 0].particle_count, Wave(0).size());
  }
}

// A void at a face becomes a notch at both faces; inside, it is a hole.
TEST(Percolation, VoidAcrossTheFaceBecomesTwoNotches) {
  for (const double x : {30.0, 0.0}) {
    SCOPED_TRACE(x);
    const PeriodicBox box = BoxOf(60, 60);
    Particles scene;
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 30; ++j) {
        const double dx = std::remainder(i + .5 - x, 60), dy = j + .5 - 15;
        if (std::hypot(dx, dy) > 7) scene.Add(i + .5, j + 10.5);
      }
    }
    Particles drop = support::Disc(2, x, 25);  // In the void.
    scene.Add(drop);
    const Result result = ReconstructOnce(In(box), Wrapped(scene, box));
    ExpectValid(result, Fill::kGreedy);
    const std::size_t holes = std::ranges::count_if(
        result.rings.outer_of, [](std::uint32_t outer) { return outer != kNoRing; });
    EXPECT_EQ(holes, x == 30 ? 1u : 0u);
    EXPECT_EQ(result.rings.RingCount(), x == 30 ? 3u : 2u);
    EXPECT_NEAR(result.statistics.area, static_cast<double>(scene.size()),
                .01 * static_cast<double>(scene.size()));
  }
}

Particles WithEverything(Particles particles) {
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.ids.push_back(3 * k + 7);
    particles.volumes.push_back(1);
    particles.velocities.insert(particles.velocities.end(), {1, 0});
  }
  return particles;
}

class DriftingBodies : public testing::TestWithParam<support::Known> {
 protected:
  void Drift(bool wraps);
};
INSTANTIATE_TEST_SUITE_P(With, DriftingBodies,
                         testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                         support::kBoth),
                         testing::PrintToStringParamName());

TEST_P(DriftingBodies, KeepTheirIdentities) { Drift(false); }
TEST_P(DriftingBodies, KeepTheirIdentitiesWrapped) { Drift(true); }

void DriftingBodies::Drift(bool wraps) {
  PeriodicBox box = BoxOf(kBoxWidth, 80);
  box.wraps = wraps;
  RingStream stream(In(box));
  for (int frame = 0; frame < 100; ++frame) {
    SCOPED_TRACE(frame);
    Particles scene = Wave(0);
    for (double& at : scene.xy) at += (&at - scene.xy.data()) % 2 == 0 ? .9 * frame : 0;
    scene.Add(support::Disc(4, 5 + .9 * frame, 42));
    scene = Wrapped(WithEverything(scene), box);
    scene.volumes.clear();
    if (!GetParam().ids) scene.ids.clear();
    if (!GetParam().velocities) scene.velocities.clear();
    for (std::size_t k = 0; k < scene.velocities.size(); k += 2) scene.velocities[k] = .9f;
    scene.time = frame;
    const Rings& rings = stream.Next(scene);
    ASSERT_GE(rings.RingCount(), 2u);
    ASSERT_LE(rings.RingCount(), wraps ? 3u : 2u);
    // The layer, the drop, and wrapped perhaps its smaller piece.
    std::vector<std::size_t> by_area(rings.RingCount());
    std::iota(by_area.begin(), by_area.end(), std::size_t{0});
    std::ranges::sort(by_area, std::greater(),
                      [&](std::size_t k) { return rings.measures[k].area; });
    for (std::size_t k = 0; k < by_area.size(); ++k) {
      EXPECT_EQ(rings.measures[by_area[k]].identity, (std::array{1u, 2u, 0u}[k]));
      if (frame == 0) continue;
      const auto parents = rings.ParentsOf(by_area[k]);
      ASSERT_EQ(parents.size(), k < 2 ? 1u : 0u);
      if (k < 2) {
        EXPECT_EQ(parents[0], k + 1);
      }
    }
  }
}

// Dense random frames: every result keeps its guarantees.
TEST(Percolation, RandomFramesKeepTheGuarantees) {
  std::uint64_t cut = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(400u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const double length_x = random.Uniform(12, 50), length_y = random.Uniform(12, 50);
    const double origin_x = random.Uniform(-20, 20), origin_y = random.Uniform(-20, 20);
    const PeriodicBox box = BoxOf(length_x, length_y, origin_x, origin_y);
    const double density = random.Uniform(.02, 1.2);
    Particles scene;
    const auto count =
        static_cast<std::size_t>(density * box.axes[0]->length * box.axes[1]->length);
    for (std::size_t k = 0; k < count; ++k) {
      const double x = random.Uniform(0, 1), y = random.Uniform(0, 1);
      scene.Add(box.axes[0]->origin + x * box.axes[0]->length,
                box.axes[1]->origin + y * box.axes[1]->length);
    }
    if (seed % 3 == 0) {
      scene = WithEverything(scene);
    }
    const Fill fill = AllFills()[seed % AllFills().size()];
    ReconstructionParameters parameters = In(box, fill);
    if (seed % 5 == 0) parameters.placement = Placement::kMarchingSquares;
    if (seed % 7 == 0) parameters.placement = Placement::kQef;
    if (seed % 11 == 0) parameters.isovalue = .6;
    if (seed % 4 == 1) parameters.cell_size = seed % 8 == 1 ? .25 : .5;
    if (seed % 9 == 0) parameters.box->wraps = true;
    const Result result = ReconstructOnce(parameters, scene);
    ExpectValid(result, fill);
    cut += result.statistics.cut_bodies;
  }
  EXPECT_GT(cut, support::Tries(400u) / 4);
}

TEST(Percolation, ThreadsAndOrderChangeNoBit) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 5);
  const PeriodicBox box = BoxOf(kBoxWidth, kBoxHeight);
  const Particles wave = Wave(3, 4, .25);
  Arena one(1);
  Result first;
  one.Execute([&] { first = ReconstructOnce(In(box), wave); });
  for (const unsigned threads : {2u, 5u}) {
    Arena arena(threads);
    arena.Execute([&] { EXPECT_EQ(ReconstructOnce(In(box), wave), first); });
  }
}

// Wrapped, everything lies in the box; areas, perimeters and particles are those of whole bodies.
TEST(Percolation, WrappedOutlinesLieInTheBox) {
  for (std::uint64_t seed = 1; seed <= support::Tries(100u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    PeriodicBox box = BoxOf(70, 66, 3.1, -8.2);  // Whole cells, so all images lie alike in them.
    Particles scene;
    for (int k = 0; k < 3; ++k) {
      const double radius = random.Uniform(1, 6), x = random.Uniform(0, 70);
      scene.Add(support::Shifted(support::Blob(random, radius), x, 22. * k));
    }
    if (seed % 2 == 0) scene.Add(support::Lattice(70, 3, .2, 50));
    scene = Wrapped(scene, box);
    const Result whole = ReconstructOnce(In(box), scene);
    box.wraps = true;
    const Result wrapped = ReconstructOnce(In(box), scene);
    ExpectValid(wrapped, Fill::kGreedy);
    for (std::size_t k = 0; k < wrapped.rings.PointCount(); ++k) {
      EXPECT_GE(wrapped.rings.points[2 * k], 3.1);
      EXPECT_LE(wrapped.rings.points[2 * k], 73.1 + 1e-8);
      EXPECT_GE(wrapped.rings.points[2 * k + 1], -8.2);
      EXPECT_LE(wrapped.rings.points[2 * k + 1], 57.8 + 1e-8);
    }
    EXPECT_NEAR(wrapped.statistics.area, whole.statistics.area, 1e-5 * whole.statistics.area);
    EXPECT_NEAR(wrapped.statistics.perimeter, whole.statistics.perimeter,
                1e-5 * whole.statistics.perimeter);
    std::uint64_t particles = 0, expected = 0;
    for (const RingMeasures& ring : whole.rings.measures) expected += ring.particle_count;
    std::set<std::uint64_t> identities;
    for (const RingMeasures& ring : wrapped.rings.measures) {
      particles += ring.particle_count;
      if (ring.area > 0 && ring.identity != 0) identities.insert(ring.identity);
    }
    EXPECT_EQ(particles, expected);
    std::set<std::uint64_t> of_whole;  // Smaller pieces of the layer have no identity.
    for (const RingMeasures& ring : whole.rings.measures) {
      if (ring.area > 0 && ring.identity != 0) of_whole.insert(ring.identity);
    }
    EXPECT_EQ(identities.size(), of_whole.size());  // A hole at a face has one in each image.
  }
}

TEST(Percolation, DiscAcrossTheCornerIsWrappedToFourPieces) {
  PeriodicBox box = BoxOf(40, 32);
  box.wraps = true;
  const Result open = ReconstructOnce({.spacing = 1.0}, support::Disc(8, 20.3, 16.3));
  const Result disc = ReconstructOnce(In(box), Wrapped(support::Disc(8, .3, .3), box));
  ASSERT_EQ(disc.rings.RingCount(), 4u);
  EXPECT_EQ(disc.rings.cuts.size(), 8u);
  EXPECT_EQ(disc.statistics.cut_bodies, 1u);
  EXPECT_NEAR(disc.statistics.area, open.statistics.area, 1e-6 * open.statistics.area);
  EXPECT_NEAR(disc.statistics.perimeter, open.statistics.perimeter,
              1e-6 * open.statistics.perimeter);
  // In the middle of the box, nothing is cut.
  const Result middle = ReconstructOnce(In(box), support::Disc(8, 20.3, 16.3));
  EXPECT_EQ(middle.rings.RingCount(), 1u);
  EXPECT_EQ(middle.statistics.cut_bodies, 0u);
  EXPECT_TRUE(middle.rings.cuts.empty());
}

TEST(Percolation, FarthestParticleIsNotWrapped) {
  ReconstructionParameters parameters = In(BoxOf(40, 40));
  parameters.box->wraps = true;
  EXPECT_TRUE(Validate(parameters).ok());
  parameters.placement = Placement::kFarthestParticle;
  EXPECT_EQ(FindViolation(Validate(parameters))->field, "parameters.box.wraps");
  parameters.placement = Placement::kVirtualPlane;
  parameters.output = Output::kSurface;
  EXPECT_TRUE(Validate(parameters).ok());
}

TEST(Percolation, FarthestParticleIsRefused) {
  RingStream stream(In(BoxOf(40, 60), Fill::kGreedy, Placement::kFarthestParticle));
  const auto violation = FindViolation(stream.Try(support::Lattice(40, 8, 0, 20)));
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, kReasonPercolates);
}

TEST(Percolation, AttributesContinueAcrossTheFace) {
  const PeriodicBox box = BoxOf(40, 60);
  const Particles layer = support::Lattice(40, 8, .5, 20);
  std::vector<float> values;
  for (std::size_t k = 0; k < layer.size(); ++k) {
    values.push_back(static_cast<float>(std::cos(2 * M_PI * layer.x(k) / 40)));
  }
  Frame frame = layer.AsFrame();
  const Attribute attribute{.name = "wave", .components = 1, .values = values};
  frame.attributes = std::span(&attribute, 1);
  const Result result = ReconstructOnce(In(box), frame);
  ExpectValid(result, Fill::kGreedy);
  ASSERT_EQ(result.attributes.size(), 1u);
  ASSERT_EQ(result.attributes[0].values.size(), result.mesh.PointCount());
  for (std::size_t k = 0; k < result.mesh.PointCount(); ++k) {
    const double expected = std::cos(2 * M_PI * result.mesh.points[2 * k] / 40);
    EXPECT_NEAR(result.attributes[0].values[k], expected, .06);
  }
}

}  // namespace
}  // namespace partiemc
