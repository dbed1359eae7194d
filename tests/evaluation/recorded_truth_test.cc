// What is known of recordings: moments, walls, and the files that tell.
#include "client/evaluation/metrics/recorded_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "client/evaluation/metrics/metrics.h"
#include "client/evaluation/scenes/random.h"
#include "client/evaluation/scenes/sampling.h"
#include "client/evaluation/scenes/shapes.h"

namespace partiemc::evaluation {
namespace {

std::vector<double> Flat(const std::vector<Point>& points) {
  std::vector<double> flat;
  for (const Point& p : points) flat.insert(flat.end(), {p.x, p.y});
  return flat;
}

TEST(MomentEllipse, IsTheEllipseThatItsParticlesFill) {
  for (const double angle : {0.0, 0.4, 1.2, 2.5}) {
    Outline ellipse;
    ellipse.AddLoop(EllipseLoop({30, -7}, 24, 10, angle));
    Random random(3);
    const auto centers = Sample(ellipse, Sampling::kHexagonal, false, random);
    const Outline fitted = MomentEllipse(Flat(centers), 1, SignedArea(ellipse));
    EXPECT_NEAR(SignedArea(fitted), SignedArea(ellipse), 0.01);
    EXPECT_LT(Compare(Curve(fitted, 1), Curve(ellipse, 1)).mean, 0.1) << angle;
  }
}

TEST(MomentEllipse, OfASquareLatticeIsTheDiscOfItsArea) {
  std::vector<double> positions;
  for (int k = 0; k < 100; ++k) {
    positions.insert(positions.end(), {0.5 * (k % 10) + 100, 0.5 * (k / 10)});
  }
  const Outline disc = MomentEllipse(positions, 0.5, 25);
  for (const Point& p : disc.points) {
    EXPECT_NEAR(Length(p - Point{102.25, 2.25}), std::sqrt(25 / std::numbers::pi), 1e-9);
  }
}

// Particles of two layers over a wall of 40 spacings along x; the outline's lower side is a sine of
// the given amplitude around `height`.
struct Layer {
  std::vector<double> positions;
  Outline outline;
};

Layer MakeLayer(double height, double amplitude, double length = 40) {
  Layer layer;
  for (double x = 0.5; x < length; ++x) {
    for (const double y : {0.5, 1.5}) layer.positions.insert(layer.positions.end(), {x, y});
  }
  std::vector<Point> loop;
  for (double x = 0; x <= length; x += 0.05) {
    loop.push_back({x, height + amplitude * std::sin(2 * std::numbers::pi * x / 2)});
  }
  loop.push_back({length, 2});
  loop.push_back({0, 2});
  layer.outline.AddLoop(loop);
  return layer;
}

constexpr std::array kFloor = {Wall{{0, 0}, {40, 0}}};

TEST(WallRoughness, IsTheStandardDeviationOfTheHeightAlongAWall) {
  // Of a sine: amplitude / sqrt(2), whatever its height.
  for (const double height : {0.0, 0.3, -0.4}) {
    const Layer layer = MakeLayer(height, 0.2);
    EXPECT_NEAR(WallRoughness(layer.outline, layer.positions, kFloor, 1), 0.2 / std::sqrt(2), 2e-3);
  }
  const Layer straight = MakeLayer(0.1, 0);
  EXPECT_NEAR(WallRoughness(straight.outline, straight.positions, kFloor, 1), 0, 1e-7);
}

TEST(WallRoughness, IsTheSameForAWallAnywhereAndInAnyUnits) {
  const Layer layer = MakeLayer(0.1, 0.3);
  const double expected = WallRoughness(layer.outline, layer.positions, kFloor, 1);
  const Similarity place{0.6, 0.8, 0.05, {-3, 11}};
  Outline outline = layer.outline;
  for (Point& p : outline.points) p = place(p);
  std::vector<double> positions;
  for (std::size_t k = 0; k < layer.positions.size(); k += 2) {
    const Point p = place({layer.positions[k], layer.positions[k + 1]});
    positions.insert(positions.end(), {p.x, p.y});
  }
  const std::array walls = {Wall{place({0, 0}), place({40, 0})}};
  EXPECT_NEAR(WallRoughness(outline, positions, walls, 0.05), expected, 1e-3);
}

TEST(WallRoughness, LeavesOutDryWallContactLinesAndCorners) {
  // The wall goes on where nothing is; the outline's own end at 40 is a contact line.
  const Layer layer = MakeLayer(0.1, 0.2);
  const std::array longer = {Wall{{-60, 0}, {100, 0}}};
  EXPECT_NEAR(WallRoughness(layer.outline, layer.positions, longer, 1), 0.2 / std::sqrt(2), 5e-3);
  const Layer puddle = MakeLayer(0.1, 0.2, 9);
  EXPECT_TRUE(std::isnan(WallRoughness(puddle.outline, puddle.positions, longer, 1)));
  EXPECT_TRUE(std::isnan(WallRoughness(layer.outline, layer.positions, {}, 1)));
}

TEST(WallRoughness, CountsAHoleInTheOutlineAsFarAway) {
  const Layer layer = MakeLayer(0, 0);
  // Half of it: heights 0 and 1.5 in equal parts.
  Outline half;
  half.AddLoop(std::array{Point{0, 0}, Point{20, 0}, Point{20, 2}, Point{0, 2}});
  EXPECT_NEAR(WallRoughness(half, layer.positions, kFloor, 1), 0.75, 0.01);
}

Sequence Recorded() {
  Sequence sequence;
  sequence.group = Group::kRecording;
  sequence.spacing = 1;
  sequence.frames.resize(2);
  for (SequenceFrame& frame : sequence.frames) frame.positions = MakeLayer(0, 0).positions;
  return sequence;
}

TEST(RecordedTruth, IsReadLineByLine) {
  Sequence sequence = Recorded();
  ASSERT_TRUE(AddTruth("# a comment\n\nwall 0 -1 40.5 1e1 # floor\r\n  spray\n", sequence).ok());
  ASSERT_EQ(sequence.walls.size(), 1u);
  EXPECT_EQ(sequence.walls[0].from, (Point{0, -1}));
  EXPECT_EQ(sequence.walls[0].to, (Point{40.5, 10}));
  EXPECT_FALSE(sequence.whole);
  EXPECT_TRUE(sequence.frames[0].truth.Empty());
  ASSERT_TRUE(AddTruth("ellipse", sequence).ok());
  EXPECT_NEAR(SignedArea(sequence.frames[1].truth), 80, 0.1);
  EXPECT_EQ(sequence.frames[1].area, 80);
}

TEST(RecordedTruth, RefusesWhatIsNoFact) {
  for (const std::string text : {"wall 0 0 1", "wall 0 0 x 1", "wall 1 1 1 1", "wall 0 0 inf 1",
                                 "ellipses", "ellipse 1", "spray yes"}) {
    Sequence sequence = Recorded();
    const absl::Status status = AddTruth("spray\n" + text, sequence);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_NE(std::string(status.message()).find(text), std::string::npos) << status;
  }
}

}  // namespace
}  // namespace partiemc::evaluation
