// Distances, jitter and defects on curves whose numbers are known.
#include "client/evaluation/metrics/metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "client/evaluation/scenes/shapes.h"
#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

Outline Disc(Point center, double radius) {
  Outline outline;
  outline.AddLoop(EllipseLoop(center, radius, radius, 0));
  return outline;
}

Rings RingsOf(const Outline& outline) {
  Rings rings;
  for (const Point& p : outline.points) {
    rings.points.insert(rings.points.end(), {p.x, p.y});
    rings.normals.insert(rings.normals.end(), {0, 0});
  }
  rings.offsets = outline.offsets;
  rings.outer_of.assign(outline.LoopCount(), kNoRing);
  return rings;
}

TEST(Deviation, OfConcentricCirclesIsTheDifferenceOfTheirRadii) {
  for (const double spacing : {1.0, 0.5}) {
    const Deviation deviation =
        Compare(Curve(Disc({}, 10), spacing), Curve(Disc({}, 10.3), spacing));
    EXPECT_NEAR(deviation.hausdorff, 0.3 / spacing, 1e-3);
    EXPECT_NEAR(deviation.mean, 0.3 / spacing, 1e-3);
  }
}

TEST(Deviation, OfShiftedCirclesIsLargestAlongTheShift) {
  const Deviation deviation = Compare(Curve(Disc({}, 10), 1), Curve(Disc({0.4, 0}, 10), 1));
  EXPECT_NEAR(deviation.hausdorff, 0.4, 1e-3);
  EXPECT_NEAR(deviation.mean, 0.4 * 2 / std::numbers::pi, 5e-3);
}

TEST(Deviation, SeesACornerThatIsCutOff) {
  Outline square, cut;
  square.AddLoop(std::vector<Point>{{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  cut.AddLoop(std::vector<Point>{{0, 0}, {10, 0}, {10, 9}, {9, 10}, {0, 10}});
  const Deviation deviation = Compare(Curve(cut, 1), Curve(square, 1));
  EXPECT_NEAR(deviation.hausdorff, std::sqrt(0.5), 1e-12);
  EXPECT_GT(deviation.mean, 0);
}

TEST(Deviation, IsSymmetricAndCountsWhatOnlyOneCurveHas) {
  Outline two = Disc({}, 5);
  two.AddLoop(EllipseLoop({30, 0}, 5, 5, 0));
  const Curve a(Disc({}, 5), 1);
  const Curve b(two, 1);
  EXPECT_NEAR(Compare(a, b).hausdorff, 30, 1e-2);
  EXPECT_EQ(Compare(a, b).hausdorff, Compare(b, a).hausdorff);
  EXPECT_EQ(Compare(a, b).mean, Compare(b, a).mean);
}

TEST(Deviation, FromNothingIsTheExtentOfWhatIsThere) {
  const Curve disc(Disc({}, 5), 1);
  const Curve nothing(Outline{}, 1);
  EXPECT_NEAR(Compare(disc, nothing).hausdorff, std::sqrt(200), 0.01);
  EXPECT_EQ(Compare(nothing, nothing).hausdorff, 0);
}

TEST(Jitter, OfAContourThatIsTransportedExactlyIsZero) {
  FlowStep step;
  step.shears[0] = {{1, 0}, 1.5, 0.2, 0.3};
  step.shears[1] = {{0, 1}, 1.0, 0.15, 1.3};
  step.vortex_center = {2, 3};
  step.vortex_radius = 15;
  step.vortex_angle = 0.4;
  for (const SharedMotion& motion :
       {SimilarityMotion({{std::cos(0.3), std::sin(0.3), 1, {5, -2}}}), FlowMotion({step})}) {
    const Outline contour = MakeShape("star", 400, 0.04);
    Outline next = contour;
    motion->Carry(0, next.points);
    const Outline carried = Carried(contour, *motion, 0, 1);
    const Deviation jitter = Jitter(Curve(carried, 1), Curve(next, 1), nullptr, nullptr);
    EXPECT_LT(jitter.hausdorff, 1e-9);
    EXPECT_LT(jitter.mean, 1e-9);
  }
}

TEST(Jitter, LeavesOutWhatTheTruthDoesNotCarryAlong) {
  // The second disc vanishes from the truth and from the contour: that is no jitter.
  Outline two = Disc({}, 5);
  two.AddLoop(EllipseLoop({30, 0}, 5, 5, 0));
  const Outline one = Disc({}, 5);
  const SegmentIndex truth_before(two, 1);
  const SegmentIndex truth_after(one, 1);
  const Deviation jitter =
      Jitter(Curve(two, 1), Curve(Disc({}, 5.02), 1), &truth_before, &truth_after);
  EXPECT_NEAR(jitter.hausdorff, 0.02, 1e-3);
}

TEST(Motion, OfAFlowKeepsAreas) {
  FlowStep step;
  step.shears[0] = {{0.6, 0.8}, 2, 0.2, 0.3};
  step.shears[1] = {{-0.8, 0.6}, 1, 0.15, 1.3};
  step.vortex_center = {4, 0};
  step.vortex_radius = 12;
  step.vortex_angle = 0.7;
  Outline disc = Densify(Disc({}, 10), 0.01);
  const double before = SignedArea(disc);
  FlowMotion({step})->Carry(0, disc.points);
  EXPECT_NEAR(SignedArea(disc) / before, 1, 1e-6);
}

TEST(Defects, CountsFoldsCrossingsAndWrongNormals) {
  Outline eight;
  eight.AddLoop(std::vector<Point>{{0, 0}, {2, 2}, {2, 0}, {0, 2}});
  Result result;
  result.rings = RingsOf(eight);
  result.mesh.points = {0, 0, 1, 0, 0, 1};
  result.mesh.triangles = {0, 1, 2, 0, 2, 1};
  result.mesh.classes = {TriangleClass::kBoundary, TriangleClass::kBoundary};
  result.rings.measures.resize(1);  // A component of no particle.
  const Outline truth = Disc({1, 1}, 2);
  const SegmentIndex index(truth, 0.5);
  for (std::size_t k = 0; k < 4; ++k) {
    // Outward at two points, inward at the others.
    const double sign = k < 2 ? 1 : -1;
    result.rings.normals[2 * k] = static_cast<float>(sign * (result.rings.points[2 * k] - 1));
    result.rings.normals[2 * k + 1] =
        static_cast<float>(sign * (result.rings.points[2 * k + 1] - 1));
  }
  const Defects defects = FindDefects(result, truth, index, 1);
  EXPECT_EQ(defects.self_intersections, 1u);
  EXPECT_EQ(defects.folds, 1u);
  EXPECT_EQ(defects.spurious_components, 1u);
  EXPECT_EQ(defects.component_error, 0u);
  EXPECT_EQ(defects.hole_error, 0u);
  EXPECT_EQ(defects.wrong_normal_share, 0.5);
}

}  // namespace
}  // namespace partiemc::evaluation
