// Identities of rings that leap, if particles have ids or velocities.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "partiemc/partiemc.h"
#include "support/ring_stream.h"
#include "support/tracked_scene.h"

namespace partiemc {
namespace {

using support::kBoth;
using support::kIds;
using support::kNothing;
using support::Known;
using support::kVelocities;
using support::Particles;
using support::RingStream;
using support::Scene;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

class Tracked : public testing::TestWithParam<Known> {};
INSTANTIATE_TEST_SUITE_P(With, Tracked, testing::Values(kIds, kVelocities, kBoth),
                         testing::PrintToStringParamName());

// A drop of radius 3 that flies past a body, 40 spacings a frame.
Scene Flight(Known known, int frame, double told_speed = 40) {
  return Scene(known, frame)
      .Add(support::Lattice(20, 10), 1)
      .Add(support::Disc(3, 40.0 * frame, 20), 1000, told_speed, 0);
}

TEST_P(Tracked, LeapingRingKeepsItsIdentity) {
  RingStream stream;
  stream.Next(Flight(GetParam(), 0));
  const std::uint64_t drop = stream.Identity(0, 20), body = stream.Identity(10, 5);
  for (int frame = 1; frame < 5; ++frame) {
    stream.Next(Flight(GetParam(), frame));
    ASSERT_EQ(stream.rings().RingCount(), 2u);
    EXPECT_EQ(stream.Identity(40 * frame, 20), drop);
    EXPECT_THAT(stream.Parents(40 * frame, 20), ElementsAre(drop));
    EXPECT_EQ(stream.Identity(10, 5), body);
    EXPECT_THAT(stream.Parents(10, 5), ElementsAre(body));
  }
}

TEST(TrackedIdentities, LeapIsNewRingWithoutIdsOrVelocities) {
  for (const auto& [known, told_speed] :
       {std::pair(kNothing, 0.0), {kVelocities, 0.0}, {kVelocities, -40.0}, {kVelocities, 1e30}}) {
    SCOPED_TRACE(told_speed);
    RingStream stream;
    stream.Next(Flight(known, 0, told_speed));
    const std::uint64_t drop = stream.Identity(0, 20), body = stream.Identity(10, 5);
    stream.Next(Flight(known, 1, told_speed));
    EXPECT_GT(stream.Identity(40, 20), std::max(drop, body));
    EXPECT_THAT(stream.Parents(40, 20), IsEmpty());
    EXPECT_EQ(stream.Identity(10, 5), body);
  }
}

TEST(TrackedIdentities, VelocitiesNeedAdvancingTime) {
  for (const double time : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity()}) {
    SCOPED_TRACE(time);
    RingStream stream;
    stream.Next(Flight(kVelocities, 0));
    const std::uint64_t highest = stream.state().history.identities_given;
    Particles later = Flight(kVelocities, 1);
    later.time = time;
    stream.Next(later);
    EXPECT_GT(stream.Identity(40, 20), highest);
  }
}

TEST(TrackedIdentities, VelocitiesAreInWorldUnitsOfThePlane) {
  // The drop flies along z, at a tenth of the usual size, half a unit of time a frame.
  RingStream stream({.spacing = 0.1, .plane = Plane::kXz});
  const auto next = [&](int frame) {
    const Particles flat = support::Disc(3, 0, 40.0 * frame);
    std::vector<double> xyz;
    std::vector<float> uvw;
    for (std::size_t k = 0; k < flat.size(); ++k) {
      xyz.insert(xyz.end(), {flat.x(k) / 10, 7, flat.y(k) / 10});
      uvw.insert(uvw.end(), {0, 99, 8});
    }
    stream.Next(Frame{.positions = std::span<const double>(xyz),
                      .components = 3,
                      .velocities = uvw,
                      .time = 0.5 * frame});
  };
  next(0);
  next(1);
  EXPECT_EQ(stream.Identity(0, 4), 1u);
}

TEST_P(Tracked, DropsInARowKeepTheirIdentities) {
  // Each drop moves exactly to the position of the one before it.
  RingStream stream;
  const auto row = [](Known known, int frame) {
    Scene scene(known, frame);
    for (int k = frame; k < frame + 6; ++k) {
      scene.Add(support::Disc(3, 12 * k, 0), static_cast<std::uint64_t>(100 * (k - frame)), 12, 0);
    }
    return scene;
  };
  stream.Next(row(GetParam(), 0));
  std::vector<std::uint64_t> identities;
  for (int k = 0; k < 6; ++k) identities.push_back(stream.Identity(12 * k, 0));
  stream.Next(row(GetParam(), 1));
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(stream.Identity(12 * (k + 1), 0), identities[static_cast<std::size_t>(k)]);
  }
  // Without ids and velocities, identities stay at their positions.
  RingStream blind;
  blind.Next(row(kNothing, 0));
  blind.Next(row(kNothing, 1));
  EXPECT_EQ(blind.Identity(12, 0), identities[1]);
}

TEST(TrackedIdentities, IdsDecideAgainstPositions) {
  // Two blocks of many particles, and two drops of few, exchange their positions.
  for (const double radius : {8.0, 2.0}) {
    RingStream stream;
    stream.Next(
        Scene(kIds, 0).Add(support::Disc(radius, 0, 0), 1).Add(support::Disc(radius, 30, 0), 1000));
    const std::uint64_t left = stream.Identity(0, 0), right = stream.Identity(30, 0);
    stream.Next(
        Scene(kIds, 1).Add(support::Disc(radius, 30, 0), 1).Add(support::Disc(radius, 0, 0), 1000));
    EXPECT_EQ(stream.Identity(0, 0), right);
    EXPECT_EQ(stream.Identity(30, 0), left);
    EXPECT_THAT(stream.Parents(0, 0), ElementsAre(right));
    // Other particles at the same position form another ring.
    stream.Next(
        Scene(kIds, 2).Add(support::Disc(radius, 30, 0), 1).Add(support::Disc(radius, 0, 0), 5000));
    EXPECT_EQ(stream.Identity(30, 0), left);
    EXPECT_GT(stream.Identity(0, 0), std::max(left, right));
    EXPECT_THAT(stream.Parents(0, 0), IsEmpty());
  }
}

// A bar of 40 and 12 columns, with a gap of 10 between them that other particles may fill. It moves
// by several of its lengths a frame.
Scene Bar(Known known, int frame, bool whole) {
  const double x = 150.0 * frame, y = -70.0 * frame;
  Scene scene(known, frame);
  scene.Add(support::Lattice(40, 12, x, y), 1, 150, -70);
  scene.Add(support::Lattice(12, 12, x + 50, y), 1000, 150, -70);
  if (whole) scene.Add(support::Lattice(10, 12, x + 40, y), 2000, 150, -70);
  return scene;
}

TEST_P(Tracked, SplitWhileLeapingIsFound) {
  RingStream stream;
  stream.Next(Bar(GetParam(), 0, true));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  const std::uint64_t bar = stream.Identity(30, 6);
  stream.Next(Bar(GetParam(), 1, false));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  EXPECT_EQ(stream.Identity(170, -64), bar);
  EXPECT_THAT(stream.Parents(170, -64), ElementsAre(bar));
  EXPECT_GT(stream.Identity(206, -64), bar);
  EXPECT_THAT(stream.Parents(206, -64), ElementsAre(bar));
}

TEST_P(Tracked, MergeWhileLeapingIsFound) {
  RingStream stream;
  stream.Next(Bar(GetParam(), 0, false));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  const std::uint64_t large = stream.Identity(20, 6), small = stream.Identity(56, 6);
  stream.Next(Bar(GetParam(), 1, true));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_EQ(stream.Identity(180, -64), large);
  EXPECT_THAT(stream.Parents(180, -64), UnorderedElementsAre(large, small));
}

TEST_P(Tracked, DropLeapsIntoAndOutOfABody) {
  RingStream stream;
  const auto drop_in = [&](int frame, double y, double velocity) {
    stream.Next(Scene(GetParam(), frame)
                    .Add(support::Lattice(30, 20), 1)
                    .Add(support::Disc(4, 15, y), 1000, 0, velocity));
  };
  drop_in(0, 60, -49);
  const std::uint64_t body = stream.Identity(15, 10), drop = stream.Identity(15, 60);
  drop_in(1, 11, 50);
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_EQ(stream.Identity(15, 10), body);
  EXPECT_THAT(stream.Parents(15, 10), UnorderedElementsAre(body, drop));
  drop_in(2, 61, 50);
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  EXPECT_EQ(stream.Identity(15, 10), body);
  EXPECT_THAT(stream.Parents(15, 10), ElementsAre(body));
  EXPECT_GT(stream.Identity(15, 61), drop);
  EXPECT_THAT(stream.Parents(15, 61), ElementsAre(body));
}

TEST_P(Tracked, HolesFollowTheirOuterRing) {
  RingStream stream;
  RingStream blind;
  // One ring flies, another one stays.
  const auto place = [&](Known known, int frame) {
    return Scene(known, frame)
        .Add(support::Shifted(support::Annulus(6, 14), 300 + 90.0 * frame, 33.0 * frame), 1, 90, 33)
        .Add(support::Annulus(4, 9), 5000);
  };
  stream.Next(place(GetParam(), 0));
  const std::uint64_t flying = stream.Identity(300, 0, true), staying = stream.Identity(0, 0, true);
  stream.Next(place(GetParam(), 1));
  ASSERT_EQ(stream.rings().RingCount(), 4u);
  EXPECT_EQ(stream.Identity(390, 33, true), flying);
  EXPECT_EQ(stream.Identity(0, 0, true), staying);
  blind.Next(place(kNothing, 0));
  blind.Next(place(kNothing, 1));
  EXPECT_GT(blind.Identity(390, 33, true), 4u);
}

TEST_P(Tracked, HoleThatStaysKeepsItsIdentity) {
  // A bubble that stands still in a body that moves by more than its diameter.
  RingStream stream;
  const auto channel = [&](int frame) {
    const Particles all = support::Lattice(60, 20, 25 * frame, 0);
    Particles fluid;
    std::vector<std::uint64_t> ids;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (std::hypot(all.x(k) - 40, all.y(k) - 9.5) < 5) continue;
      fluid.Add(all.x(k), all.y(k));
      if (GetParam().ids) fluid.ids.push_back(k);
      if (GetParam().velocities) fluid.velocities.insert(fluid.velocities.end(), {25, 0});
    }
    fluid.time = frame;
    stream.Next(fluid);
  };
  channel(0);
  const std::uint64_t hole = stream.Identity(40, 9.5, true);
  channel(1);
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  EXPECT_EQ(stream.Identity(40, 9.5, true), hole);
}

TEST(TrackedIdentities, PartWithoutSamplesIsFoundByPosition) {
  // One part in fifty leaves the body and stays close. It may hold no sample.
  for (std::uint64_t first_id = 0; first_id < 20; ++first_id) {
    RingStream stream;
    const auto scene = [&](int frame, double y) {
      return Scene(kIds, frame)
          .Add(support::Lattice(50, 30), 10000 * first_id)
          .Add(support::Lattice(10, 3, 20, y), 10000 * first_id + 2000);
    };
    stream.Next(scene(0, 30));
    ASSERT_EQ(stream.rings().RingCount(), 1u);
    const std::uint64_t body = stream.Identity(25, 15);
    stream.Next(scene(1, 33));
    ASSERT_EQ(stream.rings().RingCount(), 2u);
    EXPECT_EQ(stream.Identity(25, 15), body);
    EXPECT_GT(stream.Identity(25, 34), body);
  }
}

TEST(TrackedIdentities, SizeOfHistoryIsBounded) {
  RingStream stream;
  stream.Next(Scene(kBoth, 0).Add(support::Lattice(200, 200), 1, 1, 1));
  EXPECT_EQ(stream.state().history.samples.size(), kMaxSamples);
  stream.Next(Scene(kBoth, 1).Add(support::Lattice(2, 2), 1, 1, 1));
  EXPECT_EQ(stream.state().history.samples.size(), 4u);
  stream.Next(Scene(kNothing, 2).Add(support::Lattice(200, 200), 1));
  EXPECT_TRUE(stream.state().history.samples.empty());
  EXPECT_EQ(stream.state().history.rings[0].velocity_x, 0);
}

TEST(TrackedIdentities, FramesWithAndWithoutIdsMayAlternate) {
  RingStream stream;
  for (const Known known : {kIds, kNothing, kVelocities, kBoth, kNothing, kIds, kVelocities}) {
    stream.Next(Scene(known, 0).Add(support::Disc(6), 1));
    EXPECT_EQ(stream.Identity(0, 0), 1u);
  }
}

}  // namespace
}  // namespace partiemc
