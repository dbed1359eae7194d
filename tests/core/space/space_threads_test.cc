// The bits of a surface depend neither on the threads nor on the instruction set.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/surface_reconstructor.h"
#include "space/near_particles.h"
#include "space/point_sums.h"
#include "space/space_particles.h"
#include "support/instruction_sets.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;

/// Balls, a sheet and spray in many bricks.
SpaceParticles LargeScene() {
  Random random(3);
  SpaceParticles particles = support::Ball({0, 0, 0}, 6, .3, random);
  particles.Add(support::Ball({10, 3, 1}, 4, .1, random));
  particles.Add(support::Box({-9, -9, -12}, {9, 9, -11}, .2, random));
  for (int k = 0; k < 60; ++k) {
    const double x = random.Uniform(-16, 16), y = random.Uniform(-16, 16);
    const Vec3 at{x, y, random.Uniform(10, 24)};
    particles.Add(at);
    if (k % 3 == 0) particles.Add(at + Vec3{.7, .5, .1});
  }
  return particles;
}

class SpaceBits : public ::testing::TestWithParam<SurfacePlacement> {
 protected:
  SpaceBits()
      : reconstructor_(*SurfaceReconstructor::Create(
            {.placement = GetParam(), .clean = true, .min_component_particles = 2})),
        particles_(LargeScene()) {}

  Surface Reconstruct() {
    Surface surface;
    EXPECT_TRUE(reconstructor_.Reconstruct(particles_.AsFrame(), workspace_, surface).ok());
    return surface;
  }

  const SurfaceReconstructor reconstructor_;
  const SpaceParticles particles_;
  SurfaceWorkspace workspace_;
};

TEST_P(SpaceBits, AreTheSameForAnyNumberOfThreads) {
  std::vector<Surface> surfaces;
  for (const unsigned threads : {1u, 2u, 7u}) {
    // Otherwise there are no more workers than processors.
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Arena(threads).Execute([&] { surfaces.push_back(Reconstruct()); });
  }
  EXPECT_GT(surfaces[0].ShellCount(), 5u);
  EXPECT_GT(surfaces[0].TriangleCount(), 2000u);
  EXPECT_GT(surfaces[0].statistics.dropped_spray, 5u);
  for (const Surface& surface : surfaces) EXPECT_EQ(surface, surfaces[0]);
}

TEST_P(SpaceBits, AreTheSameForAnyInstructionSet) {
  const Surface expected = Reconstruct();
  const int sets = support::ForEachInstructionSet([&] { EXPECT_EQ(Reconstruct(), expected); });
  EXPECT_GT(sets, 1) << "the processor has one instruction set only";
}

/// The partial sums of a block by plain loops, in the order that the kernels promise.
struct PlainSums {
  space::PartialMoments moments;
  space::PartialSlopes slopes;
  space::PartialThirds thirds;

  PlainSums(const space::NearBlock& block, const space::QueryPoint& point, float inverse_square,
            const Vec3& v) {
    const auto vx = static_cast<float>(v.x), vy = static_cast<float>(v.y),
               vz = static_cast<float>(v.z);
    for (int p = 0; p < block.count; ++p) {
      const auto add = [p](auto& sums, const auto& terms) {
        for (std::size_t q = 0; q < terms.size(); ++q) sums.lanes[q][p % 8] += terms[q];
      };
      const float x = block.x[p] - point.x, y = block.y[p] - point.y, z = block.z[p] - point.z;
      const float t = std::max(0.0f, 1.0f - (x * x + y * y + z * z) * inverse_square);
      const float w = block.weight[p];
      const float k = t * t * t, kx = k * x, ky = k * y, kz = k * z;
      add(moments,
          std::array{k, k * w, kx, ky, kz, kx * x, kx * y, kx * z, ky * y, ky * z, kz * z});
      const float s = t * t, sx = s * x, sy = s * y, sz = s * z;
      add(slopes, std::array{sx, sy, sz, sx * x, sx * y, sx * z, sy * y, sy * z, sz * z, w * sx,
                             w * sy, w * sz});
      const float along = t * (vx * x + vy * y + vz * z), square = along * along;
      add(thirds, std::array{square * x, square * y, square * z});
    }
  }
};

TEST(PointSums, HaveTheBitsOfScalarLoops) {
  Random random(1);
  const auto coordinate = [&] { return static_cast<float>(random.Uniform(-4, 4)); };
  for (int trial = 0; trial < support::Tries(200); ++trial) {
    space::NearBlock block;
    block.count = static_cast<int>(random.Below(space::NearBlock::kCapacity));
    block.has_weights = trial % 2 == 0;
    for (int p = 0; p < block.count; ++p) {
      block.x[p] = coordinate();
      block.y[p] = coordinate();
      block.z[p] = coordinate();
      block.weight[p] = block.has_weights ? coordinate() : 1;
    }
    block.Pad();
    const space::QueryPoint point{coordinate(), coordinate(), coordinate()};
    const Vec3 v = Normalised({coordinate(), 1, coordinate()});
    constexpr float kInverse = 1.0f / 9;
    const PlainSums expected(block, point, kInverse, v);
    support::ForEachInstructionSet([&] {
      space::PartialMoments moments;
      space::PartialSlopes slopes;
      space::PartialThirds thirds;
      AddMoments(block, point, kInverse, moments);
      space::PartialMoments again;
      AddMomentsAndSlopes(block, point, kInverse, again, slopes);
      AddThirds(block, point, kInverse, v, thirds);
      EXPECT_EQ(moments.lanes, expected.moments.lanes);
      EXPECT_EQ(again.lanes, expected.moments.lanes);
      EXPECT_EQ(slopes.lanes, expected.slopes.lanes);
      EXPECT_EQ(thirds.lanes, expected.thirds.lanes);
    });
  }
}

INSTANTIATE_TEST_SUITE_P(All, SpaceBits,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

}  // namespace
}  // namespace partiemc
