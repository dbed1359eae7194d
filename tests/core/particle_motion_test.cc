// How movers carry points.
#include "particle_motion.h"

#include <gtest/gtest.h>

#include <vector>

namespace partiemc {
namespace {

constexpr double kReach = 3;

TEST(ParticleMotion, OfACrowdThoseThatCameFirstAreHeardOf) {
  std::vector<Mover> movers;
  for (int k = 0; k < 200; ++k) movers.push_back({{1, 1}, {0.25, 0.5}});
  ParticleMotion motion;
  motion.Build(movers, kReach);
  const auto carried = motion.Carry({1.5, 1});
  ASSERT_TRUE(carried);
  for (int k = 0; k < 100'000; ++k) movers.push_back({{1, 1}, {-0.75, 0.5}});
  motion.Build(movers, kReach);
  const auto in_a_crowd = motion.Carry({1.5, 1});
  ASSERT_TRUE(in_a_crowd);
  EXPECT_EQ(in_a_crowd->x, carried->x);
  EXPECT_EQ(in_a_crowd->y, carried->y);
  EXPECT_NEAR(in_a_crowd->x, 1.75, 1e-12);
}

TEST(ParticleMotion, WithoutAMoverInReachThereIsNoWay) {
  ParticleMotion motion;
  motion.Build({}, kReach);
  EXPECT_FALSE(motion.Carry({0, 0}));
  const Mover mover{{0, 0}, {1, 0}};
  motion.Build(std::span(&mover, 1), kReach);
  EXPECT_TRUE(motion.Carry({2.9, 0}));
  EXPECT_FALSE(motion.Carry({3.1, 0}));
}

}  // namespace
}  // namespace partiemc
