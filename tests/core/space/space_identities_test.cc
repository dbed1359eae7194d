// Identities of bodies and cavities through motion, splits and merges.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "partiemc/arena.h"
#include "space/surface_stream.h"

namespace partiemc {
namespace {

using support::kBoth;
using support::kIds;
using support::kNothing;
using support::Known;
using support::kVelocities;
using support::Random;
using support::SpaceParticles;
using support::SurfaceStream;
using support::TrackedParticles;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr SurfaceParameters kPlanes{.placement = SurfacePlacement::kVirtualPlane};

SpaceParticles Block(double x, int columns) {
  Random random(1);
  return support::Box({x, 0, 0}, {x + columns - 1, 4, 4}, 0, random);
}

SpaceParticles BallAt(const Vec3& centre, double radius) {
  Random random(1);
  return support::Ball(centre, radius, 0, random);
}

class TrackedBodies : public ::testing::TestWithParam<Known> {};
// Without ids and velocities, a body that leaps is a new one.
class LeapingBodies : public TrackedBodies {};
INSTANTIATE_TEST_SUITE_P(With, LeapingBodies, ::testing::Values(kIds, kVelocities, kBoth),
                         ::testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(With, TrackedBodies, ::testing::Values(kNothing, kIds, kVelocities, kBoth),
                         ::testing::PrintToStringParamName());

// Ten bars of two blocks with a gap between them. Other particles fill the gap of every second bar,
// in turns, so that each frame after the first has five merges and five splits. With ids or
// velocities the bars leap by several of their lengths.
constexpr int kBars = 10;
Vec3 ShiftOf(Known known, int bar, int frame) {
  const bool leaps = known.ids || known.velocities;
  const double x = leaps ? (bar % 2 == 0 ? 60 : -45) * frame : frame / 2;
  return {x, 14.0 * bar, leaps ? 31.0 * frame : 0};
}

TrackedParticles Bars(Known known, int frame) {
  TrackedParticles all{.known = known, .time = .5 * frame};
  for (int bar = 0; bar < kBars; ++bar) {
    const Vec3 shift = ShiftOf(known, bar, frame);
    const Vec3 velocity = 2.0 * (ShiftOf(known, bar, 1) - ShiftOf(known, bar, 0));
    const auto first = static_cast<std::uint64_t>(1000 * bar);
    all.Add(Block(0, 7), first, velocity, shift);
    all.Add(Block(11, 4), first + 400, velocity, shift);
    if ((bar + frame) % 2 == 0) all.Add(Block(7, 4), first + 700, velocity, shift);
  }
  return all;
}

TEST_P(TrackedBodies, KeepIdentitiesThroughMergesAndSplits) {
  const Known known = GetParam();
  for (const SurfaceParameters& parameters : {SurfaceParameters{}, kPlanes}) {
    SurfaceStream stream(parameters);
    std::vector<std::uint64_t> large(kBars), small(kBars, 0);
    int merges = 0, splits = 0;
    for (int frame = 0; frame < 5; ++frame) {
      const std::uint64_t given = stream.state().history.identities_given;
      ASSERT_EQ(stream.Next(Bars(known, frame)).ShellCount(), 15u);
      for (int bar = 0; bar < kBars; ++bar) {
        SCOPED_TRACE(::testing::Message() << "frame " << frame << ", bar " << bar);
        const Vec3 shift = ShiftOf(known, bar, frame);
        const bool is_whole = (bar + frame) % 2 == 0;
        const Vec3 of_large = shift + Vec3{is_whole ? 7.0 : 3, 2, 2},
                   of_small = shift + Vec3{13, 2, 2};
        const auto k = static_cast<std::size_t>(bar);
        if (frame == 0) {
          EXPECT_THAT(stream.Parents(of_large), IsEmpty());
          large[k] = stream.Identity(of_large);
          if (!is_whole) small[k] = stream.Identity(of_small);
          continue;
        }
        EXPECT_EQ(stream.Identity(of_large), large[k]);
        if (is_whole) {
          EXPECT_THAT(stream.Parents(of_large), UnorderedElementsAre(large[k], small[k]));
          ++merges;
        } else {
          EXPECT_THAT(stream.Parents(of_large), ElementsAre(large[k]));
          EXPECT_THAT(stream.Parents(of_small), ElementsAre(large[k]));
          small[k] = stream.Identity(of_small);
          EXPECT_GT(small[k], given);
          ++splits;
        }
      }
    }
    EXPECT_EQ(merges, 20);
    EXPECT_EQ(splits, 20);
  }
}

// Drops of all sizes, lone particles among them, that fly past each other.
TEST_P(LeapingBodies, DropsKeepTheirIdentities) {
  const Known known = GetParam();
  SurfaceStream stream(kPlanes);
  constexpr int kDrops = 12;
  std::vector<std::uint64_t> identities;
  for (int frame = 0; frame < 4; ++frame) {
    TrackedParticles all{.known = known, .time = static_cast<double>(frame)};
    std::vector<Vec3> centres;
    for (int drop = 0; drop < kDrops; ++drop) {
      // Velocities move a drop by whole cells, and the smallest drops have one node.
      const double along = known.ids ? 33.25 : 33;
      const Vec3 velocity{drop % 2 == 0 ? along : -along, 0, 3.0 * drop};
      const Vec3 shift = Vec3{0, 11.0 * drop, 0} + static_cast<double>(frame) * velocity;
      centres.push_back(shift + Vec3{.4, .4, .4});
      all.Add(BallAt({0, 0, 0}, drop / 3), static_cast<std::uint64_t>(500 * drop), velocity,
              centres.back());
    }
    ASSERT_EQ(stream.Next(all).ShellCount(), std::size_t{kDrops});
    for (int drop = 0; drop < kDrops; ++drop) {
      const Vec3& at = centres[static_cast<std::size_t>(drop)];
      if (frame == 0) {
        identities.push_back(stream.Identity(at));
        continue;
      }
      const std::uint64_t identity = identities[static_cast<std::size_t>(drop)];
      EXPECT_EQ(stream.Identity(at), identity) << "drop " << drop << ", frame " << frame;
      EXPECT_THAT(stream.Parents(at), ElementsAre(identity));
    }
  }
}

TEST(BodyIdentities, IdsDecideAgainstPositions) {
  for (const double radius : {1.0, 4.0}) {
    SurfaceStream stream(kPlanes);
    const Vec3 left{0, 0, 0}, right{20, 0, 0};
    const auto scene = [&](std::uint64_t first_left, std::uint64_t first_right) {
      TrackedParticles all{.known = kIds};
      all.Add(BallAt(left, radius), first_left);
      all.Add(BallAt(right, radius), first_right);
      return all;
    };
    stream.Next(scene(0, 1000));
    const std::uint64_t a = stream.Identity(left), b = stream.Identity(right);
    stream.Next(scene(1000, 0));
    EXPECT_EQ(stream.Identity(left), b);
    EXPECT_EQ(stream.Identity(right), a);
    // Other particles at the same position form another body.
    stream.Next(scene(5000, 0));
    EXPECT_EQ(stream.Identity(right), a);
    EXPECT_GT(stream.Identity(left), std::max(a, b));
    EXPECT_THAT(stream.Parents(left), IsEmpty());
    // Without ids, positions decide.
    TrackedParticles blind = scene(0, 1000);
    blind.ids.clear();
    stream.Next(blind);
    EXPECT_EQ(stream.Identity(right), a);
  }
}

// A hollow ball with a ball in its cavity, which may be open.
SpaceParticles Hollow(bool is_open, double inner) {
  SpaceParticles all;
  const SpaceParticles ball = BallAt({0, 0, 0}, 9);
  for (std::size_t k = 0; k < ball.size(); ++k) {
    const Vec3 at = ball.At(k);
    if (Length(at) < 6.5 || (is_open && at.x > 0 && std::hypot(at.y, at.z) < 3.5)) continue;
    all.Add(at);
  }
  all.Add(BallAt({inner, 0, 0}, 1.5));
  return all;
}

TEST_P(TrackedBodies, CavitiesFollowTheirBodies) {
  const Known known = GetParam();
  const double leap = known.ids || known.velocities ? 70 : 1;
  for (const SurfaceParameters& parameters : {SurfaceParameters{}, kPlanes}) {
    SurfaceStream stream(parameters);
    const auto next = [&](int frame, bool is_open) {
      TrackedParticles all{.known = known, .time = static_cast<double>(frame)};
      all.Add(Hollow(is_open, 0), 0, {leap, 0, 0}, {leap * frame, 0, 0});
      return stream.Next(all).ShellCount();
    };
    ASSERT_EQ(next(0, false), 3u);
    const std::uint64_t cavity = stream.Identity({0, 0, 0}, true);
    const std::size_t shell = stream.Shell({0, 0, 0}, true);
    const std::uint32_t outer = stream.surface().outer_of[shell];
    const std::uint64_t body = stream.surface().measures[outer].identity;
    std::uint64_t inner = 0;
    for (const ShellMeasures& measures : stream.surface().measures) {
      if (measures.identity != cavity && measures.identity != body) inner = measures.identity;
    }
    ASSERT_EQ(next(1, false), 3u);
    EXPECT_EQ(stream.Identity({leap, 0, 0}, true), cavity);
    EXPECT_THAT(stream.Parents({leap, 0, 0}, true), ElementsAre(cavity));
    const std::size_t moved = stream.Shell({leap, 0, 0}, true);
    EXPECT_EQ(stream.surface().measures[stream.surface().outer_of[moved]].identity, body);
    if (known.ids) continue;       // Ids are indices here, so they must not change.
    ASSERT_EQ(next(2, true), 2u);  // The cavity vanishes, the bodies stay.
    for (std::size_t k = 0; k < 2; ++k) {
      const std::uint64_t identity = stream.surface().measures[k].identity;
      EXPECT_TRUE(identity == body || identity == inner);
      EXPECT_THAT(stream.surface().ParentsOf(k), ElementsAre(identity));
    }
  }
}

TEST(BodyIdentities, CavityHasTheNodesOnBothSidesOfItsIsland) {
  SurfaceStream stream;
  TrackedParticles all{.known = kNothing};
  all.Add(Hollow(false, 0), 0);
  ASSERT_EQ(stream.Next(all).ShellCount(), 3u);
  const ShellHistory& history = stream.state().history;
  int left = 0, right = 0;
  for (const ShellRun& run : history.runs) {
    if (run.row != 0 || run.layer != 0 || !history.shells[run.shell].is_cavity) continue;
    left += run.last < 0;
    right += run.first > 0;
  }
  EXPECT_EQ(left, 1);
  EXPECT_EQ(right, 1);
}

// The body of the last frame does not move, so only the velocities of its parts relate them to it.
TEST(BodyIdentities, PartsThatLeapApartHaveTheirBodyAsParent) {
  SurfaceStream stream;
  TrackedParticles whole{.known = kVelocities, .time = 0}, parts{.known = kVelocities, .time = 1};
  for (const double side : {-1.0, 1.0}) {
    const Vec3 leap{0, 40 * side, 0};
    whole.Add(Block(side < 0 ? 0 : 7, 7), 0);
    parts.Add(Block(side < 0 ? 0 : 7, 7), 0, leap, leap);
  }
  ASSERT_EQ(stream.Next(whole).ShellCount(), 1u);
  const std::uint64_t identity = stream.surface().measures[0].identity;
  ASSERT_EQ(stream.Next(parts).ShellCount(), 2u);
  for (const double y : {-38.0, 42.0})
    EXPECT_THAT(stream.Parents({7, y, 2}), ElementsAre(identity));
}

TEST(BodyIdentities, EmptyFrameEndsAll) {
  SurfaceStream stream;
  TrackedParticles all{.known = kIds};
  all.Add(BallAt({0, 0, 0}, 3), 0);
  stream.Next(all);
  EXPECT_EQ(stream.Identity({0, 0, 0}), 1u);
  stream.Next(TrackedParticles{.known = kIds});
  EXPECT_EQ(stream.surface().ShellCount(), 0u);
  EXPECT_EQ(stream.state().history.identities_given, 1u);
  EXPECT_TRUE(stream.state().history.runs.empty());
  stream.Next(all);
  EXPECT_EQ(stream.Identity({0, 0, 0}), 2u);
  EXPECT_THAT(stream.Parents({0, 0, 0}), IsEmpty());
}

// Balls and lone particles that fly through a box, so that bodies merge and split.
TrackedParticles SpaceTurmoil(Known known, std::uint64_t seed, int frame) {
  Random random(seed);
  TrackedParticles all{.known = known, .time = .25 * frame};
  const auto wrapped = [](double value) { return value - 18 * std::floor(value / 18); };
  for (std::uint64_t k = 0; k < 14; ++k) {
    const double x = random.Uniform(0, 18), y = random.Uniform(0, 18), z = random.Uniform(0, 18);
    const double u = random.Uniform(-4, 4), v = random.Uniform(-4, 4), w = random.Uniform(-4, 4);
    const double radius = random.Chance(.3) ? 0 : random.Uniform(.5, 2.3);
    all.Add(BallAt({0, 0, 0}, radius), 1000 * k, {4 * u, 4 * v, 4 * w},
            {wrapped(x + u * frame), wrapped(y + v * frame), wrapped(z + w * frame)});
  }
  return all;
}

TEST_P(TrackedBodies, OrderThreadsAndRestartsHaveNoEffect) {
  for (const SurfaceParameters& parameters : {SurfaceParameters{}, kPlanes}) {
    SurfaceStream stream(parameters), permuted(parameters), restored(parameters);
    Random random(3);
    std::size_t merges = 0;
    for (int frame = 0; frame < 3; ++frame) {
      const TrackedParticles particles = SpaceTurmoil(GetParam(), 1, frame);
      const Surface& expected = stream.Next(particles, true);
      EXPECT_EQ(permuted.Next(particles.Permuted(random), true), expected);
      EXPECT_EQ(permuted.state(), stream.state());
      auto state = ParseSurfaceState(Serialize(restored.state()));
      ASSERT_TRUE(state.ok()) << state.status();
      EXPECT_EQ(*state, restored.state());
      restored.state() = *std::move(state);
      constexpr unsigned kThreads[] = {1, 2, 7};
      const unsigned threads = kThreads[frame % 3];
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      Arena(threads).Execute([&] { restored.Next(particles, true); });
      EXPECT_EQ(restored.surface(), expected);
      EXPECT_EQ(restored.state(), stream.state());
      for (std::size_t k = 0; k < expected.ShellCount(); ++k) {
        merges += expected.ParentsOf(k).size() > 1;
      }
    }
    if (GetParam().ids) {
      EXPECT_GT(merges, 0u);
    }
  }
}

TEST(BodyIdentities, AreUniqueAndParentsAreOfTheLastFrame) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    SurfaceStream stream(kPlanes);
    std::map<std::uint64_t, bool> before;
    std::uint64_t highest = 0;
    for (int frame = 0; frame < 4; ++frame) {
      const Surface& surface =
          stream.Next(SpaceTurmoil(seed % 2 == 0 ? kIds : kNothing, seed, frame));
      std::map<std::uint64_t, bool> now;
      ASSERT_EQ(surface.parent_offsets.size(), surface.ShellCount() + 1);
      EXPECT_EQ(stream.state().history.shells.size(), surface.ShellCount());
      for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
        const std::uint64_t identity = surface.measures[shell].identity;
        const bool is_cavity = surface.outer_of[shell] != kNoShell;
        EXPECT_TRUE(now.emplace(identity, is_cavity).second);
        const auto parents = surface.ParentsOf(shell);
        EXPECT_TRUE(std::is_sorted(parents.begin(), parents.end()));
        for (const std::uint64_t parent : parents) {
          ASSERT_TRUE(before.contains(parent));
          EXPECT_EQ(before[parent], is_cavity);
        }
        if (std::find(parents.begin(), parents.end(), identity) == parents.end()) {
          EXPECT_GT(identity, highest);
        }
      }
      if (!now.empty()) highest = std::max(highest, now.rbegin()->first);
      std::vector<bool> has_run(surface.ShellCount());
      for (const ShellRun& run : stream.state().history.runs) has_run[run.shell] = true;
      EXPECT_EQ(std::count(has_run.begin(), has_run.end(), false), 0);
      before = now;
    }
  }
}

TEST(BodyIdentities, ChangeNothingElse) {
  SurfaceStream with(kPlanes), without(kPlanes);
  for (int frame = 0; frame < 2; ++frame) {
    Surface tracked = with.Next(SpaceTurmoil(kBoth, 2, frame));
    Surface alone;
    SurfaceWorkspace workspace;
    TrackedParticles particles = SpaceTurmoil(kNothing, 2, frame);
    ASSERT_TRUE(with.reconstructor().Reconstruct(particles.AsFrame(), workspace, alone).ok());
    EXPECT_EQ(alone.parent_offsets, std::vector<std::uint32_t>{0});
    for (const ShellMeasures& measures : alone.measures) EXPECT_EQ(measures.identity, 0u);
    tracked.parents.clear();
    tracked.parent_offsets = {0};
    for (ShellMeasures& measures : tracked.measures) measures.identity = 0;
    EXPECT_EQ(tracked, alone);
  }
}

// Cancels the frame at the second request, and otherwise refuses the memory at a request.
class StopAtRequest final : public MemoryGuard {
 public:
  StopAtRequest(int request, std::atomic<bool>* flag) : left_(request), flag_(flag) {}
  bool Reserve(std::uint64_t) override {
    if (--left_ != 0) return true;
    if (flag_ == nullptr) return false;
    flag_->store(true);
    return true;
  }

 private:
  int left_;
  std::atomic<bool>* flag_;
};

TEST_P(TrackedBodies, RefusedAndCancelledFramesHaveNoEffect) {
  SurfaceStream disturbed(kPlanes), undisturbed(kPlanes);
  for (int frame = 0; frame < 2; ++frame) {
    TrackedParticles good = SpaceTurmoil(GetParam(), 1, frame);
    EXPECT_EQ(disturbed.Next(good), undisturbed.Next(good));
    TrackedParticles bad = SpaceTurmoil(GetParam(), 1, frame + 1);
    bad.xyz[4] = std::nan("");
    EXPECT_TRUE(absl::IsInvalidArgument(disturbed.Try(bad.AsFrame())));
    EXPECT_EQ(disturbed.state(), undisturbed.state());
    for (const int request : {1, 2}) {
      TrackedParticles next = SpaceTurmoil(GetParam(), 1, frame + 1);
      std::atomic<bool> flag = false;
      StopAtRequest canceller(request, &flag), refuser(request, nullptr);
      EXPECT_TRUE(absl::IsCancelled(
          disturbed.Try(next.AsFrame(), {.memory = &canceller, .cancelled = &flag})));
      EXPECT_EQ(disturbed.state(), undisturbed.state());
      EXPECT_TRUE(absl::IsResourceExhausted(disturbed.Try(next.AsFrame(), {.memory = &refuser})));
      EXPECT_EQ(disturbed.state(), undisturbed.state());
      EXPECT_EQ(disturbed.surface(), Surface());
    }
  }
}

}  // namespace
}  // namespace partiemc
