// Bodies of a periodic box whose images lie differently in the lattice, or that are long or tiny.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/boxes.h"
#include "partiemc/partiemc.h"
#include "partiemc/state.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RingStream;

// A block of particles with its lower left one at (x, y).
void AddBlock(Particles& scene, int side, double x, double y) {
  scene.Add(support::Lattice(side, side, x, y));
}

// Two bodies less than a cell apart may be joined in one image and apart in the other, because the
// length is not a whole number of cells. None of them is lost.
TEST(PercolationBodies, BodiesThatAreJoinedInOneImageOnlyAreKept) {
  const PeriodicBox box = BoxOf(30.5, 60, .5, 0);
  for (std::uint64_t seed = 1; seed <= support::Tries(300u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Particles scene;
    for (int i = 0; i < 30; ++i) {
      for (int j = 0; j < 4; ++j) scene.Add(1 + i * 30.5 / 30, j + 5.);
    }
    const double x = random.Uniform(-.5, 1.5), gap = random.Uniform(2.4, 2.6);
    const int left = 2 + static_cast<int>(random.Below(4));
    AddBlock(scene, left, x - gap / 2 - left + 1, 12 + random.Uniform(0, 1));
    const int right = 2 + static_cast<int>(random.Below(3));
    AddBlock(scene, right, x + gap / 2, 12 + random.Uniform(0, 2));
    const Result result = ReconstructOnce(In(box), Wrapped(scene, box));
    ExpectValid(result, Fill::kGreedy);
    EXPECT_EQ(ParticlesOf(result.rings), scene.size());
  }
}

// The image of a bar that nearly reaches its own image may contain particles and their copies.
TEST(PercolationBodies, BarsThatNearlyReachTheirImageCountOnce) {
  for (std::uint64_t seed = 1; seed <= support::Tries(1000u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    PeriodicBox box = BoxOf(40, random.Uniform(13, 25));
    box.axes[0].reset();
    const double length = box.axes[1]->length - random.Uniform(2.3, 2.8);
    const double from = random.Uniform(0, 25), across = random.Uniform(0, 1);
    const int gaps = static_cast<int>(std::floor(length));
    Particles scene;
    for (int k = 0; k <= gaps; ++k) {
      for (int j = 0; j < 2; ++j) scene.Add(across + j, from + k * length / gaps);
    }
    const Result result = ReconstructOnce(In(box), Wrapped(scene, box));
    ExpectValid(result, Fill::kGreedy);
    EXPECT_EQ(ParticlesOf(result.rings), scene.size());
  }
}

// The given particle lies between the nodes of a coarse lattice, its copies lie on nodes.
TEST(PercolationBodies, DropBesideNodesIsKeptOnce) {
  PeriodicBox box = BoxOf(19, 40);
  box.axes[1].reset();
  ReconstructionParameters parameters = In(box);
  parameters.cell_size = 2;
  RingStream stream(parameters);
  Particles scene;
  for (int i = 0; i < 19; ++i) {
    for (int j = 0; j < 5; ++j) scene.Add(i + .5, j + .5);
  }
  scene.Add(9, 8);
  for (std::size_t k = 0; k < scene.size(); ++k) scene.ids.push_back(k);
  const Rings& rings = stream.Next(scene);
  EXPECT_LE(rings.RingCount(), 2u);
  EXPECT_TRUE(ParseState(Serialize(stream.state())).ok());
  const std::uint64_t particles = ParticlesOf(rings);
  parameters.min_component_particles = 1;
  EXPECT_EQ(ParticlesOf(ReconstructOnce(parameters, scene).rings), particles);
}

// Rings of a fine lattice move over whole cells, also beyond the face.
TEST(PercolationBodies, RingsOfAFineLatticeMoveAwayFromCells) {
  for (double x = 55.2; x < 56; x += .04) {
    SCOPED_TRACE(x);
    const PeriodicBox box = BoxOf(60, 60, .03, 0);
    Particles scene;
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 30; ++j) {
        if (std::hypot(i + .5 - x, j + .5 - 15) > 4) scene.Add(i + .5, j + 10.5);
      }
    }
    scene.volumes.assign(scene.size(), .8f);
    ReconstructionParameters parameters = In(box);
    parameters.cell_size = .25;
    ExpectValid(ReconstructOnce(parameters, scene), Fill::kGreedy);
  }
}

// Spray is judged by the whole body, not by the part of it that has copies.
TEST(PercolationBodies, LongBodiesAreNoSpray) {
  PeriodicBox box = BoxOf(100, 100);
  box.wraps = true;
  Particles scene = support::Lattice(60, 10, -9.7, 20);
  scene.Add(support::Disc(3, 50, 60));
  ReconstructionParameters parameters = In(box);
  parameters.min_component_particles = 300;
  const Result result = ReconstructOnce(parameters, Wrapped(scene, box));
  ExpectValid(result, Fill::kGreedy);
  EXPECT_EQ(result.rings.RingCount(), 2u);
  EXPECT_EQ(ParticlesOf(result.rings), 600u);
  EXPECT_EQ(result.statistics.dropped_spray, 1u);
  EXPECT_NEAR(result.statistics.area, 600, 3);
}

TEST(PercolationBodies, AreaOfALongBodyDoesNotDependOnTheFace) {
  PeriodicBox box = BoxOf(100, 100);
  box.wraps = true;
  ReconstructionParameters parameters = In(box);
  parameters.min_component_area = 800;
  for (const double x : {51.3, 1.3}) {
    const Particles body = Wrapped(support::Lattice(98, 10, x, 20), box);
    EXPECT_EQ(ParticlesOf(ReconstructOnce(parameters, body).rings), 980u) << x;
  }
}

TEST(PercolationBodies, TinyOriginIsZero) {
  const Particles layer = support::Lattice(40, 8, .5, 20);
  const Result zero = ReconstructOnce(In(BoxOf(40, 60)), layer);
  const Result tiny = ReconstructOnce(In(BoxOf(40, 60, 1e-130)), layer);
  ExpectValid(tiny, Fill::kGreedy);
  EXPECT_EQ(tiny.rings.points, zero.rings.points);
}

// No node of the lattice lies in the window and in the drop, whose pieces lie at both faces.
TEST(PercolationBodies, DropWithoutNodesInTheBoxHasAnIdentity) {
  PeriodicBox box = BoxOf(40.85, 40, .05, 0);
  box.wraps = true;
  RingStream stream(In(box));
  Particles drop;
  drop.Add(.05, 8);
  for (int frame = 0; frame < 3; ++frame) {
    const Rings& rings = stream.Next(drop);
    ASSERT_GE(rings.RingCount(), 1u);
    std::vector<std::uint64_t> identities;
    for (const RingMeasures& ring : rings.measures) identities.push_back(ring.identity);
    EXPECT_THAT(identities, testing::Contains(1u)) << frame;
  }
}

}  // namespace
}  // namespace partiemc
