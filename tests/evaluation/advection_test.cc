// Contours and points carried along by the particles of a recording, and what they know of it.
#include "client/evaluation/metrics/advection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "client/evaluation/metrics/metrics.h"
#include "client/evaluation/scenes/random.h"

namespace partiemc::evaluation {
namespace {

constexpr double kTolerance = 0.1;  // Of JitterWhereKnown.

Outline Disc(Point center, double radius) {
  std::vector<Point> loop;
  constexpr int kCount = 400;
  for (int k = 0; k < kCount; ++k) {
    const double angle = 2 * std::numbers::pi * k / kCount;
    loop.push_back(center + radius * Point{std::cos(angle), std::sin(angle)});
  }
  Outline disc;
  disc.AddLoop(loop);
  return disc;
}

// The points of a lattice of spacing 1 within a disc, each moved at random by up to 0.2.
std::vector<Point> DiscOfParticles(Point center, double radius, std::uint64_t seed) {
  Random random(seed);
  std::vector<Point> particles;
  const int reach = static_cast<int>(radius) + 1;
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const Point p{i + random.Uniform(-0.2, 0.2), j + random.Uniform(-0.2, 0.2)};
      if (Length(p) < radius) particles.push_back(center + p);
    }
  }
  return particles;
}

SequenceFrame FrameOf(const std::vector<Point>& particles, double time) {
  SequenceFrame frame;
  frame.time = time;
  for (const Point& p : particles) frame.positions.insert(frame.positions.end(), {p.x, p.y});
  return frame;
}

void NumberFrom(std::uint64_t first, SequenceFrame& frame) {
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) frame.ids.push_back(first + k);
}

// Frames 0 and 1 of particles with ids that go from the one place to the other.
std::pair<SequenceFrame, SequenceFrame> Recorded(const std::vector<Point>& before,
                                                 const std::vector<Point>& after) {
  std::pair<SequenceFrame, SequenceFrame> frames{FrameOf(before, 0), FrameOf(after, 1)};
  NumberFrom(1, frames.first);
  NumberFrom(1, frames.second);
  return frames;
}

TEST(Advection, FollowsIdentitiesInAnyOrder) {
  std::vector<Point> particles = DiscOfParticles({}, 9, 1);
  SequenceFrame from = FrameOf(particles, 0);
  NumberFrom(1, from);
  for (Point& p : particles) p = p + Point{3, -1};
  std::reverse(particles.begin(), particles.end());
  SequenceFrame to = FrameOf(particles, 1);
  to.ids.assign(from.ids.rbegin(), from.ids.rend());
  const auto advection = Advection::Between(from, to, 1);
  ASSERT_TRUE(advection.has_value());
  const Outline carried = advection->Carry(Disc({}, 8));
  EXPECT_LT(Compare(Curve(carried, 1), Curve(Disc({3, -1}, 8), 1)).hausdorff, 1e-9);
}

TEST(Advection, UsesVelocitiesWhereThereAreNoIdentities) {
  const std::vector<Point> particles = {{0, 0}, {1, 0}, {0, 1}};
  SequenceFrame from = FrameOf(particles, 2);
  from.velocities = {4, 0, 4, 0, 4, 0};
  const SequenceFrame to = FrameOf(particles, 2.5);
  Outline contour;
  contour.AddLoop(std::vector<Point>{{0, 0}, {1, 0}, {50, 50}});  // The last one is far from all.
  const auto advection = Advection::Between(from, to, 1);
  ASSERT_TRUE(advection.has_value());
  const Outline carried = advection->Carry(contour);
  EXPECT_NEAR(carried.points[0].x, 2, 1e-12);
  EXPECT_FALSE(Advection::Between(FrameOf(particles, 0), to, 1).has_value());
}

// A contour has all of its particles on one side: their mean would lag behind by the shear over the
// distance to their centre, 0.1 of it here.
TEST(Advection, FollowsAShearBeyondTheOutermostParticles) {
  std::vector<Point> before;
  for (int k = 0; k < 400; ++k) before.push_back({k % 20 - 9.5, k / 20 - 19.5});
  std::vector<Point> after = before;
  for (Point& p : after) p.x += 0.1 * p.y;
  const auto [from, to] = Recorded(before, after);
  Outline contour;
  contour.AddLoop(std::vector<Point>{{0, 0}, {-1, 0}, {-1, -10}});
  const Outline carried = Advection::Between(from, to, 1)->Carry(contour);
  EXPECT_NEAR(carried.points[0].x, 0, 0.05);
  EXPECT_NEAR(carried.points[0].y, 0, 1e-12);
}

TEST(Advection, KnowsEveryPlaceAroundABodyThatMovesAsOne) {
  std::vector<Point> before = DiscOfParticles({}, 9, 2);
  before.push_back({40, 0});  // A lone particle and a pair.
  before.push_back({0, 40});
  before.push_back({1, 40});
  const Similarity motion{std::cos(0.1), std::sin(0.1), 1, {7, -3}};
  std::vector<Point> after = before;
  for (Point& p : after) p = motion(p);
  const auto [from, to] = Recorded(before, after);
  const auto advection = Advection::Between(from, to, 1);
  Outline contour = Disc({}, 9.5);
  contour.AddLoop(Disc({40, 0}, 0.8).points);
  contour.AddLoop(Disc({0.5, 40}, 1).points);
  Outline next = contour;
  for (Point& p : next.points) p = motion(p);
  const KnownJitter jitter = JitterWhereKnown(Curve(contour, 1), Curve(next, 1), *advection);
  EXPECT_EQ(jitter.known_share, 1);
  EXPECT_LT(jitter.deviation.mean, 0.01);

  // Without turning nothing is left to chance at all.
  for (std::size_t k = 0; k < before.size(); ++k) after[k] = before[k] + Point{7, -3};
  const auto [start, end] = Recorded(before, after);
  const auto shift = Advection::Between(start, end, 1);
  for (const Point& p : contour.points) EXPECT_LT(shift->Forward(p).uncertainty, 1e-9);
}

TEST(Advection, KnowsNothingWhereParticlesTradePlacesAtRandom) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const std::vector<Point> before = DiscOfParticles({}, 12, seed);
    std::vector<Point> after = before;
    Random random(100 + seed);
    for (std::size_t k = after.size(); k-- > 1;) std::swap(after[k], after[random.Below(k + 1)]);
    const auto [from, to] = Recorded(before, after);
    const Curve contour(Disc({}, 12.5), 1);
    const KnownJitter jitter = JitterWhereKnown(contour, contour, *Advection::Between(from, to, 1));
    EXPECT_EQ(jitter.known_share, 0) << seed;
    EXPECT_TRUE(std::isnan(jitter.deviation.mean)) << seed;
  }
}

// Particles that move by themselves blur the place of an outline by about their own step over the
// square root of how many there are, not by the whole of it.
TEST(Advection, IsAsUncertainAsTheMeanOfTheParticlesAround) {
  const std::vector<Point> before = DiscOfParticles({}, 20, 3);
  Random random(4);
  for (const double step : {0.05, 0.2, 0.8}) {
    std::vector<Point> after = before;
    for (Point& p : after) p = p + Point{random.Uniform(-step, step), random.Uniform(-step, step)};
    const auto [from, to] = Recorded(before, after);
    const auto advection = Advection::Between(from, to, 1);
    double uncertainty = 0, error = 0, count = 0;
    for (const Point& p : Disc({}, 20.5).points) {
      const Advection::Trace trace = advection->Forward(p);
      uncertainty += trace.uncertainty * trace.uncertainty;
      error += Dot(trace.point - p, trace.point - p) / 2;  // Along one axis.
      ++count;
    }
    // The larger of both frames' standard errors and the way back: above what the error is, by less
    // than twice.
    EXPECT_GT(std::sqrt(uncertainty / count), std::sqrt(error / count)) << step;
    EXPECT_LT(std::sqrt(uncertainty / count), 2 * std::sqrt(error / count)) << step;
  }
}

TEST(Advection, DoesNotKnowWhereBodiesMeet) {
  std::vector<Point> before = DiscOfParticles({-12, 0}, 10, 5);
  const std::size_t first_count = before.size();
  for (const Point& p : DiscOfParticles({14, 0}, 10, 6)) before.push_back(p);
  std::vector<Point> after = before;
  for (std::size_t k = 0; k < after.size(); ++k) after[k].x += k < first_count ? 2 : -2;
  const auto [from, to] = Recorded(before, after);
  const auto advection = Advection::Between(from, to, 1);
  // Where the one leaves from nothing is seen of the other: only where it arrives.
  EXPECT_GT(advection->Forward({-1.7, 0}).uncertainty, kTolerance);
  EXPECT_GT(advection->Backward({0.3, 0}).uncertainty, kTolerance);
  EXPECT_LT(advection->Forward({-22.5, 0}).uncertainty, 1e-9);
  EXPECT_LT(advection->Backward({22.5, 0}).uncertainty, 1e-9);
}

TEST(Advection, DoesNotKnowWhereParticlesComeOrGo) {
  const std::vector<Point> particles = DiscOfParticles({}, 10, 7);
  auto [from, to] = Recorded(particles, particles);
  for (SequenceFrame* frame : {&from, &to}) {
    const double side = frame == &from ? 10 : -10;
    frame->positions.insert(frame->positions.end(), {side, 0});
    frame->ids.push_back(frame == &from ? 1'000'000 : 2'000'000);
  }
  const auto advection = Advection::Between(from, to, 1);
  for (const double side : {-10.0, 10.0}) {
    EXPECT_TRUE(std::isinf(advection->Forward({side, 1}).uncertainty));
    EXPECT_TRUE(std::isinf(advection->Backward({side, 1}).uncertainty));
  }
  EXPECT_LT(advection->Forward({0, 10}).uncertainty, 1e-9);
  EXPECT_TRUE(std::isinf(advection->Forward({0, 14}).uncertainty));  // Beyond every particle.
}

// By velocities alone the way back uses those of the other frame: it misses by what they changed.
TEST(Advection, DoesNotTrustVelocitiesThatChange) {
  const std::vector<Point> before = DiscOfParticles({}, 10, 8);
  std::vector<Point> after = before;
  for (Point& p : after) p.x += 1;
  SequenceFrame from = FrameOf(before, 0);
  SequenceFrame to = FrameOf(after, 1);
  for (std::size_t k = 0; k < before.size(); ++k) {
    from.velocities.insert(from.velocities.end(), {1, 0});
    to.velocities.insert(to.velocities.end(), {1.3, 0});
  }
  EXPECT_NEAR(Advection::Between(from, to, 1)->Forward({10, 0}).uncertainty, 0.3, 1e-9);
  to.velocities = from.velocities;
  EXPECT_LT(Advection::Between(from, to, 1)->Forward({10, 0}).uncertainty, 1e-9);
  to.velocities.clear();  // Nothing leads back.
  EXPECT_TRUE(std::isinf(Advection::Between(from, to, 1)->Forward({10, 0}).uncertainty));
}

// One half of the particles move as one, the other half at random: what is off there is no jitter.
TEST(JitterWhereKnown, LeavesOutWhatNobodyKnows) {
  const std::vector<Point> before = DiscOfParticles({}, 20, 9);
  std::vector<Point> after = before;
  Random random(10);
  for (Point& p : after) {
    p = p + (p.x < 0 ? Point{2, 0} : Point{random.Uniform(-6, 6), random.Uniform(-6, 6)});
  }
  const auto [from, to] = Recorded(before, after);
  const auto advection = Advection::Between(from, to, 1);
  Outline next = Disc({}, 20.5);
  for (Point& p : next.points) p = p + (p.x < 0 ? Point{2.05, 0} : -0.3 * p);
  const KnownJitter jitter = JitterWhereKnown(Curve(Disc({}, 20.5), 1), Curve(next, 1), *advection);
  EXPECT_GT(jitter.known_share, 0.3);
  EXPECT_LT(jitter.known_share, 0.5);
  EXPECT_NEAR(jitter.deviation.hausdorff, 0.05, 0.005);
  EXPECT_GT(Compare(Curve(advection->Carry(Disc({}, 20.5)), 1), Curve(next, 1)).mean, 0.5);
  const KnownJitter nothing = JitterWhereKnown(Curve({}, 1), Curve(next, 1), *advection);
  EXPECT_TRUE(std::isnan(nothing.deviation.mean));
}

}  // namespace
}  // namespace partiemc::evaluation
