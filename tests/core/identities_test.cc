// Identities of rings through motion, splits and merges, for any order and any number of threads.
#include "identities/identities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "partiemc/partiemc.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"

namespace partiemc {
namespace {

using support::Particles;
using support::RingStream;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

Particles Together(std::initializer_list<Particles> parts) {
  Particles all;
  for (const Particles& part : parts) all.Add(part);
  return all;
}

// A bar of particles, with or without its middle third.
Particles Bar(bool whole, double y = 0) {
  Particles bar = Together({support::Lattice(30, 12, 0, y), support::Lattice(12, 12, 40, y)});
  if (whole) bar.Add(support::Lattice(10, 12, 30, y));
  return bar;
}

TEST(Identities, FirstFrameHasDistinctRingsWithoutParents) {
  RingStream stream;
  const Rings& rings = stream.Next(
      Together({support::Disc(6, 0, 0), support::Annulus(20, 40), support::Disc(3, 60, 0)}));
  ASSERT_EQ(rings.RingCount(), 4u);
  std::set<std::uint64_t> identities;
  for (std::size_t ring = 0; ring < 4; ++ring) {
    identities.insert(rings.measures[ring].identity);
    EXPECT_THAT(rings.ParentsOf(ring), IsEmpty());
  }
  EXPECT_THAT(identities, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(rings.parent_offsets, ElementsAre(0, 0, 0, 0, 0));
}

TEST(Identities, PassingDiscsKeepTheirIdentities) {
  RingStream stream;
  std::uint64_t right_going = 0, left_going = 0;
  for (int k = 0; k <= 40; ++k) {
    const double x = 2.0 * k;
    stream.Next(Together({support::Disc(8, x, 0), support::Disc(8, 80 - x, 30)}));
    ASSERT_EQ(stream.rings().RingCount(), 2u);
    if (k == 0) {
      right_going = stream.Identity(0, 0);
      left_going = stream.Identity(80, 30);
      EXPECT_NE(right_going, left_going);
      continue;
    }
    EXPECT_EQ(stream.Identity(x, 0), right_going);
    EXPECT_EQ(stream.Identity(80 - x, 30), left_going);
    EXPECT_THAT(stream.Parents(x, 0), ElementsAre(right_going));
    EXPECT_THAT(stream.Parents(80 - x, 30), ElementsAre(left_going));
  }
}

TEST(Identities, NeighbourThatMovesInIsNoParent) {
  // Two blocks side by side; both move right by a third of their width, so that the left one comes
  // to lie where the edge of the right one was.
  RingStream stream;
  stream.Next(Together({support::Lattice(18, 18, 0, 0), support::Lattice(18, 18, 22, 0)}));
  const std::uint64_t left = stream.Identity(9, 9);
  const std::uint64_t right = stream.Identity(31, 9);
  ASSERT_NE(left, right);
  stream.Next(Together({support::Lattice(18, 18, 6, 0), support::Lattice(18, 18, 28, 0)}));
  EXPECT_EQ(stream.Identity(15, 9), left);
  EXPECT_EQ(stream.Identity(37, 9), right);
  EXPECT_THAT(stream.Parents(15, 9), ElementsAre(left));
  EXPECT_THAT(stream.Parents(37, 9), ElementsAre(right));
}

TEST(Identities, LargerPartKeepsIdentityAfterSplit) {
  RingStream stream;
  stream.Next(Bar(true));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  const std::uint64_t whole = stream.Identity(25, 6);
  stream.Next(Bar(false));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  EXPECT_EQ(stream.Identity(15, 6), whole);
  EXPECT_GT(stream.Identity(46, 6), whole);
  EXPECT_THAT(stream.Parents(15, 6), ElementsAre(whole));
  EXPECT_THAT(stream.Parents(46, 6), ElementsAre(whole));
}

TEST(Identities, LargerPartIsContinuedAfterMerge) {
  RingStream stream;
  stream.Next(Bar(false));
  const std::uint64_t large = stream.Identity(15, 6);
  const std::uint64_t small = stream.Identity(46, 6);
  stream.Next(Bar(true));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_EQ(stream.Identity(25, 6), large);
  EXPECT_THAT(stream.Parents(25, 6), UnorderedElementsAre(large, small));
  // After another split, the smaller part is a new ring with a new identity.
  stream.Next(Bar(false));
  EXPECT_EQ(stream.Identity(15, 6), large);
  EXPECT_GT(stream.Identity(46, 6), std::max(large, small));
}

TEST(Identities, SmallDropBecomesParentOfLargeBody) {
  RingStream stream;
  stream.Next(Together({support::Lattice(40, 20), support::Disc(2.5, 20, 25)}));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  const std::uint64_t body = stream.Identity(20, 9);
  const std::uint64_t drop = stream.Identity(20, 25);
  stream.Next(Together({support::Lattice(40, 20), support::Disc(2.5, 20, 22)}));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_EQ(stream.Identity(20, 9), body);
  EXPECT_THAT(stream.Parents(20, 9), UnorderedElementsAre(body, drop));
}

TEST(Identities, HolesAndIslandsAreTrackedSeparately) {
  // A ring of fluid with an island in it; the island drifts, then the fluid ring opens.
  RingStream stream;
  const auto scene = [](double x, bool open) {
    Particles fluid = support::Annulus(15, 25);
    if (open) {
      Particles rest;
      for (std::size_t k = 0; k < fluid.size(); ++k) {
        if (fluid.x(k) < 0 || std::abs(fluid.y(k)) > 5) rest.Add(fluid.x(k), fluid.y(k));
      }
      fluid = rest;
    }
    fluid.Add(support::Disc(4, x, 0));
    return fluid;
  };
  stream.Next(scene(-2, false));
  ASSERT_EQ(stream.rings().RingCount(), 3u);
  const std::uint64_t hole = stream.Identity(0, 0, true);
  const std::uint64_t island = stream.Identity(-2, 0.1);
  EXPECT_NE(hole, island);
  stream.Next(scene(1, false));
  ASSERT_EQ(stream.rings().RingCount(), 3u);
  EXPECT_EQ(stream.Identity(0, 0, true), hole);
  EXPECT_THAT(stream.Parents(0, 0, true), ElementsAre(hole));
  std::set<std::uint64_t> before;
  for (const RingMeasures& measures : stream.rings().measures) before.insert(measures.identity);
  EXPECT_EQ(before.size(), 3u);
  stream.Next(scene(2, true));
  ASSERT_EQ(stream.rings().RingCount(), 2u);  // The hole vanished; fluid and island stay.
  for (std::size_t ring = 0; ring < 2; ++ring) {
    EXPECT_TRUE(before.contains(stream.rings().measures[ring].identity));
    EXPECT_NE(stream.rings().measures[ring].identity, hole);
    EXPECT_THAT(stream.rings().ParentsOf(ring),
                ElementsAre(stream.rings().measures[ring].identity));
  }
}

TEST(Identities, RingMissingInOneFrameIsNew) {
  RingStream stream;
  stream.Next(Together({support::Disc(6), support::Disc(6, 40, 0)}));
  const std::uint64_t kept = stream.Identity(0, 0);
  const std::uint64_t lost = stream.Identity(40, 0);
  stream.Next(support::Disc(6));
  stream.Next(Together({support::Disc(6), support::Disc(6, 40, 0)}));
  EXPECT_EQ(stream.Identity(0, 0), kept);
  EXPECT_GT(stream.Identity(40, 0), std::max(kept, lost));
  EXPECT_THAT(stream.Parents(40, 0), IsEmpty());
}

TEST(Identities, EmptyFrameEndsAllIdentities) {
  RingStream stream;
  stream.Next(support::Disc(6));
  EXPECT_EQ(stream.Identity(0, 0), 1u);
  stream.Next(Particles{});
  EXPECT_EQ(stream.rings().RingCount(), 0u);
  EXPECT_TRUE(stream.state().history.runs.empty());
  EXPECT_EQ(stream.state().history.identities_given, 1u);
  stream.Next(support::Disc(6));
  EXPECT_EQ(stream.Identity(0, 0), 2u);
  EXPECT_THAT(stream.Parents(0, 0), IsEmpty());
}

TEST(Identities, RefusedFrameChangesNothing) {
  RingStream disturbed, undisturbed;
  Particles bad = support::Disc(6);
  bad.xy[3] = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < 5; ++k) {
    const Particles body = support::MovingBody(k);
    EXPECT_EQ(disturbed.Next(body), undisturbed.Next(body));
    const State before = disturbed.state();
    EXPECT_FALSE(disturbed.Try(bad).ok());
    EXPECT_EQ(disturbed.state(), before);
  }
}

// Spray, bodies and holes that form, break and join.
Particles Turmoil(std::uint64_t seed, int frame) {
  support::Random random(seed);
  Particles particles;
  for (int k = 0; k < 120; ++k) {
    const double x = random.Uniform(0, 90), y = random.Uniform(0, 90);
    const double vx = random.Uniform(-1.5, 1.5), vy = random.Uniform(-1.5, 1.5);
    particles.Add(support::Disc(random.Uniform(0.5, 6), x + vx * frame, y + vy * frame));
  }
  return particles;
}

TEST(Identities, AreUniqueAndParentsAreOfTheLastFrame) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    RingStream stream;
    std::map<std::uint64_t, bool> before;  // Identity: is it a hole?
    std::uint64_t highest = 0;
    int splits = 0, merges = 0;
    for (int k = 0; k < 12; ++k) {
      const Rings& rings = stream.Next(Turmoil(seed, k));
      std::map<std::uint64_t, bool> now;
      std::map<std::uint64_t, int> children;
      ASSERT_EQ(rings.parent_offsets.size(), rings.RingCount() + 1);
      for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
        const std::uint64_t identity = rings.measures[ring].identity;
        const bool hole = rings.outer_of[ring] != kNoRing;
        EXPECT_NE(identity, 0u);
        EXPECT_TRUE(now.emplace(identity, hole).second);
        const auto parents = rings.ParentsOf(ring);
        EXPECT_TRUE(std::is_sorted(parents.begin(), parents.end()));
        for (const std::uint64_t parent : parents) {
          ASSERT_TRUE(before.contains(parent));
          EXPECT_EQ(before[parent], hole);
          ++children[parent];
        }
        merges += parents.size() > 1;
        // An identity continues a parent's or is new.
        if (std::find(parents.begin(), parents.end(), identity) == parents.end()) {
          EXPECT_GT(identity, highest);
        }
      }
      for (const auto& [parent, count] : children) {
        splits += count > 1;
        if (count == 1) continue;
        // One child continues it, or none, if each child continues a larger parent.
        EXPECT_LE(now.count(parent), 1u);
      }
      if (!now.empty()) highest = std::max(highest, now.rbegin()->first);
      before = now;
    }
    EXPECT_GT(splits, 0);
    EXPECT_GT(merges, 0);
  }
}

TEST(Identities, DoNotDependOnOrderThreadsOrRestarts) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    RingStream stream, permuted, restored;
    support::Random random(seed);
    for (int k = 0; k < 8; ++k) {
      const Particles particles = Turmoil(seed, k);
      const Rings& expected = stream.Next(particles);
      const Rings& other = permuted.Next(support::Permuted(particles, random));
      ASSERT_EQ(other.RingCount(), expected.RingCount());
      for (std::size_t ring = 0; ring < expected.RingCount(); ++ring) {
        EXPECT_EQ(other.measures[ring].identity, expected.measures[ring].identity);
      }
      EXPECT_EQ(other.parents, expected.parents);
      auto state = ParseState(Serialize(restored.state()));
      ASSERT_TRUE(state.ok()) << state.status();
      EXPECT_EQ(*state, restored.state());
      restored.state() = *std::move(state);
      tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1 + 3 * (k % 3));
      tbb::task_arena arena(1 + 3 * (k % 3));
      arena.execute([&] { restored.Next(particles); });
      EXPECT_EQ(restored.rings(), expected);
      EXPECT_EQ(restored.state(), stream.state());
    }
  }
}

TEST(Identities, DoNotDependOnTheOrderOfRings) {
  // Shifted by part of a tile, the same scene has its rings in another order.
  for (const auto& [dx, dy] : {std::pair(16.0, 16.0), {-16.0, 0.0}, {7.0, 21.0}}) {
    RingStream here, there;
    int reordered = 0;
    for (int k = 0; k < 6; ++k) {
      const Particles particles = support::Snapped(Turmoil(5, k), 1);
      here.Next(particles);
      there.Next(support::Shifted(particles, dx, dy));
      ASSERT_EQ(here.rings().RingCount(), there.rings().RingCount());
      for (std::size_t ring = 0; ring < here.rings().RingCount(); ++ring) {
        const RingMeasures& measures = here.rings().measures[ring];
        const bool hole = here.rings().outer_of[ring] != kNoRing;
        const double x = measures.centroid_x + dx, y = measures.centroid_y + dy;
        EXPECT_EQ(there.Identity(x, y, hole), measures.identity);
        const auto parents = here.rings().ParentsOf(ring);
        EXPECT_EQ(there.Parents(x, y, hole),
                  std::vector<std::uint64_t>(parents.begin(), parents.end()));
        reordered += there.Ring(x, y, hole) != ring;
      }
    }
    EXPECT_GT(reordered, 0);
  }
}

TEST(Identities, EveryPlacementTracksTheRingsThatItKeeps) {
  for (const Placement placement : AllPlacements()) {
    RingStream stream({.placement = placement, .spacing = 1.0});
    // A lone particle's ring is dropped by `farthest-particle`.
    stream.Next(Together({support::Lattice(1, 1, -20, 0), support::Disc(6)}));
    const std::uint64_t disc = stream.Identity(0, 0);
    EXPECT_EQ(stream.state().history.rings.size(), stream.rings().RingCount());
    stream.Next(Together({support::Lattice(1, 1, -20, 0), support::Disc(6, 1, 0)}));
    EXPECT_EQ(stream.Identity(1, 0), disc);
    EXPECT_EQ(stream.rings().parent_offsets.size(), stream.rings().RingCount() + 1);
  }
}

TEST(Identities, StateGrowsWithOutlineNotArea) {
  RingStream stream;
  stream.Next(support::Lattice(200, 200));
  EXPECT_LT(stream.state().history.runs.size(), 210u);
}

}  // namespace
}  // namespace partiemc
