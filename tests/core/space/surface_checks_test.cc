// Validate(Surface): each guarantee is broken by a planted fault, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "base/predicates_in_space.h"
#include "check/triangle_contact.h"
#include "partiemc/surface.h"
#include "space/shells.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::AddShell;
using support::BallShell;
using support::BoxShell;
using support::InsideOut;
using support::Measure;
using support::Shell;
using ::testing::StartsWith;

/// A ball with a cavity, in the cavity a box, and a ball beside.
Surface GoodSurface(double shift = 0) {
  Surface surface;
  const Vec3 by{shift, -shift, 2 * shift};
  AddShell(BallShell(by, 10, 2), kNoShell, surface);
  AddShell(InsideOut(BallShell(by + Vec3{1, 0, 0}, 6, 2)), 0, surface);
  AddShell(BoxShell(by - Vec3{1, 1, 1}, by + Vec3{1, 1, 1}), kNoShell, surface);
  AddShell(BallShell(by + Vec3{20, 0, 0}, 4, 1), kNoShell, surface);
  return surface;
}

void ExpectBroken(const Surface& surface, const std::string& guarantee) {
  const absl::Status status = Validate(surface);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), StartsWith(guarantee));
}

TEST(SurfaceChecks, AcceptsGoodSurfaces) {
  EXPECT_TRUE(Validate(Surface{}).ok());
  for (const double shift : {0.0, 1e3 + .1, 1e6}) {
    const absl::Status status = Validate(GoodSurface(shift));
    EXPECT_TRUE(status.ok()) << status.message();
  }
}

TEST(SurfaceChecks, FindsOpenEdge) {
  Surface surface = GoodSurface();
  surface.triangles.resize(surface.triangles.size() - 3);
  --surface.triangle_offsets.back();
  Measure(surface);
  ExpectBroken(surface, "S1");
}

TEST(SurfaceChecks, FindsFlippedTriangle) {
  Surface surface = GoodSurface();
  std::swap(surface.triangles[30], surface.triangles[31]);
  Measure(surface);
  ExpectBroken(surface, "S1");
}

TEST(SurfaceChecks, FindsTriangleTwice) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  box.triangles.insert(box.triangles.end(), {box.triangles[0], box.triangles[1], box.triangles[2]});
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S1");
}

// Two boxes with a common edge.
TEST(SurfaceChecks, FindsEdgeOfFourTriangles) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  const Shell other = BoxShell({1, 1, 0}, {2, 2, 1});
  // Corners 3 and 7 of the first box are corners 0 and 4 of the other one.
  for (const std::uint32_t k : other.triangles) {
    box.triangles.push_back(k == 0 ? 3 : k == 4 ? 7 : 8 + k);
  }
  box.points.insert(box.points.end(), other.points.begin(), other.points.end());
  box.points[8] = {5, 5, 5};
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S1");
}

// Two boxes with a common corner.
TEST(SurfaceChecks, FindsPointOfTwoCycles) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  const Shell other = BoxShell({1, 1, 1}, {2, 2, 2});
  for (const std::uint32_t k : other.triangles) box.triangles.push_back(k == 0 ? 7 : 7 + k);
  box.points.insert(box.points.end(), other.points.begin() + 1, other.points.end());
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S2");
}

TEST(SurfaceChecks, FindsPointWithoutTriangles) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  box.points.push_back({3, 3, 3});
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S2");
}

TEST(SurfaceChecks, FindsShellOfTwoPieces) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  const Shell other = BoxShell({2, 2, 2}, {3, 3, 3});
  for (const std::uint32_t k : other.triangles) box.triangles.push_back(8 + k);
  box.points.insert(box.points.end(), other.points.begin(), other.points.end());
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S2");
}

TEST(SurfaceChecks, FindsTouchingShells) {
  for (const Vec3& corner : {Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{1, 1, 1}, Vec3{1, .25, .25}}) {
    Surface surface;
    AddShell(BoxShell({0, 0, 0}, {1, 1, 1}), kNoShell, surface);
    AddShell(BoxShell(corner, corner + Vec3{.5, .5, .5}), kNoShell, surface);
    ExpectBroken(surface, "S3");
  }
  Surface surface;
  AddShell(BoxShell({0, 0, 0}, {1, 1, 1}), kNoShell, surface);
  AddShell(BoxShell({std::nextafter(1.0, 2.0), 0, 0}, {2, 1, 1}), kNoShell, surface);
  EXPECT_TRUE(Validate(surface).ok());
}

TEST(SurfaceChecks, FindsIntersectingShells) {
  Surface surface = GoodSurface();
  AddShell(BallShell({26.5, 0, 0}, 3, 2), kNoShell, surface);
  ExpectBroken(surface, "S3");
}

TEST(SurfaceChecks, FindsPointPushedThroughItsShell) {
  Surface surface = GoodSurface();
  const std::size_t first = surface.point_offsets[3];
  for (int axis = 0; axis < 3; ++axis) {
    double& moved = surface.points[3 * first + axis];
    moved = 2 * (axis == 0 ? 20 : 0) - moved * 1.25 + (axis == 0 ? 5 : 0);
  }
  Measure(surface);
  ExpectBroken(surface, "S3");
}

TEST(SurfaceChecks, FindsDegenerateTriangle) {
  Surface surface;
  Shell box = BoxShell({0, 0, 0}, {1, 1, 1});
  // A point on the edge from corner 0 to 4, used by the triangles of one side only.
  box.points.push_back({0, 0, .5});
  box.triangles.insert(box.triangles.end(), {0, 8, 4});
  for (std::size_t t = 0; t < 3; t += 3) {
    ASSERT_EQ(box.triangles[0], 0u);
    ASSERT_EQ(box.triangles[1], 4u);
    box.triangles[0] = 8;  // (0, 4, 6) becomes (8, 4, 6) and (0, 8, 6).
    box.triangles.insert(box.triangles.end(), {0, 8, 6});
  }
  std::swap(box.triangles[37], box.triangles[38]);  // (0, 4, 8): runs along both.
  AddShell(box, kNoShell, surface);
  ExpectBroken(surface, "S3");
}

TEST(SurfaceChecks, FindsCoordinateOutsideRange) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e-90, 1e100}) {
    Surface surface = GoodSurface();
    surface.points[4] = bad;
    ExpectBroken(surface, "S3");
  }
}

TEST(SurfaceChecks, FindsBodyInsideOut) {
  Surface surface;
  AddShell(InsideOut(BoxShell({0, 0, 0}, {1, 1, 1})), kNoShell, surface);
  ExpectBroken(surface, "S4");
}

// Its volume is below the rounding errors of its terms.
TEST(SurfaceChecks, DecidesOrientationOfFlatShell) {
  for (const bool is_good : {true, false}) {
    Surface surface;
    const Shell box = BoxShell({1, 1, 1}, {2, 2, std::nextafter(1.0, 2.0)});
    AddShell(is_good ? box : InsideOut(box), kNoShell, surface);
    const absl::Status status = Validate(surface);
    EXPECT_EQ(status.message().substr(0, 2), is_good ? "" : "S4") << status.message();
  }
}

TEST(SurfaceChecks, FindsCavityWithoutBody) {
  Surface surface;
  AddShell(BallShell({0, 0, 0}, 2, 1), kNoShell, surface);
  AddShell(InsideOut(BallShell({9, 0, 0}, 2, 1)), 0, surface);
  ExpectBroken(surface, "S4");
}

TEST(SurfaceChecks, FindsCavityOfOtherBody) {
  Surface surface = GoodSurface();
  surface.outer_of[1] = 3;
  ExpectBroken(surface, "S4");
}

TEST(SurfaceChecks, FindsBodyInBody) {
  Surface surface;
  AddShell(BallShell({0, 0, 0}, 2, 1), kNoShell, surface);
  AddShell(BallShell({0, 0, 0}, 1, 1), kNoShell, surface);
  ExpectBroken(surface, "S4");
}

// All coordinates are small integers, so lines through points run through edges.
TEST(SurfaceChecks, FindsNestingOnLattice) {
  Surface surface;
  AddShell(BoxShell({0, 0, 0}, {8, 8, 8}), kNoShell, surface);
  AddShell(InsideOut(BoxShell({1, 1, 1}, {7, 7, 7})), 0, surface);
  AddShell(BoxShell({2, 2, 2}, {6, 6, 6}), kNoShell, surface);
  AddShell(InsideOut(BoxShell({3, 3, 3}, {4, 4, 4})), 2, surface);
  AddShell(BoxShell({8, 8, 9}, {9, 9, 10}), kNoShell, surface);
  const absl::Status status = Validate(surface);
  EXPECT_TRUE(status.ok()) << status.message();
  surface.outer_of[3] = 0;
  ExpectBroken(surface, "S4");
}

TEST(SurfaceChecks, FindsWrongSizesNormalsMeasures) {
  const auto spoil = [](auto change) {
    Surface surface = GoodSurface();
    change(surface);
    ExpectBroken(surface, "S5");
  };
  spoil([](Surface& surface) { surface.normals.pop_back(); });
  spoil([](Surface& surface) { surface.normals[2] = .9f; });
  spoil([](Surface& surface) { surface.normals[2] = std::nanf(""); });
  spoil([](Surface& surface) { surface.measures.pop_back(); });
  spoil([](Surface& surface) { surface.measures[1].area *= 1.01; });
  spoil([](Surface& surface) { surface.measures[1].volume *= -1; });
  spoil([](Surface& surface) { surface.measures[0].centroid_y += .01; });
  spoil([](Surface& surface) { surface.measures[0].volume = std::nan(""); });
  spoil([](Surface& surface) { surface.measures[0].area = std::nan(""); });
  spoil([](Surface& surface) { surface.measures[0].centroid_y = std::nan(""); });
  spoil([](Surface& surface) { surface.cuts = {0}; });  // Its area counts it.
  spoil([](Surface& surface) { surface.cuts = {1, 0}; });
  spoil([](Surface& surface) { surface.cuts = {0xffffffff}; });
  spoil([](Surface& surface) { surface.point_offsets.back() = 0; });
  spoil([](Surface& surface) { surface.triangle_offsets.clear(); });
}

TEST(SurfaceChecks, FindsIndexOfOtherShellOrNone) {
  Surface surface = GoodSurface();
  surface.triangles[4] = surface.point_offsets[1];
  ExpectBroken(surface, "S2");
  surface.triangles[4] = 1'000'000;
  ExpectBroken(surface, "S2");
}

// --- Predicates ---------------------------------------------------------------------------------

TEST(SideOfPlane, DecidesLastBit) {
  const Vec3 a{.1, .2, .3}, b{1.1, .2, .3}, c{.1, 1.2, .3};
  EXPECT_EQ(SideOfPlane(a, b, c, {7.7, -3.3, .3}), 0);
  EXPECT_EQ(SideOfPlane(a, b, c, {7.7, -3.3, std::nextafter(.3, 1)}), 1);
  EXPECT_EQ(SideOfPlane(a, b, c, {7.7, -3.3, std::nextafter(.3, 0)}), -1);
}

TEST(SideOfPlane, ChangesSignWithEverySwap) {
  std::mt19937 random(5);
  int zeros = 0;
  for (int trial = 0; trial < support::Tries(20'000); ++trial) {
    // Nearly or exactly coplanar, with coordinates whose differences are not exact.
    const auto value = [&] { return .1 * static_cast<double>(random() % 7) + 1e-3 / 3; };
    Vec3 p[4];
    for (Vec3& point : p) point = {value(), value(), 1e3 * value()};
    const int side = SideOfPlane(p[0], p[1], p[2], p[3]);
    zeros += side == 0;
    EXPECT_EQ(SideOfPlaneExact(p[0], p[1], p[2], p[3]), side);
    EXPECT_EQ(SideOfPlane(p[1], p[0], p[2], p[3]), -side);
    EXPECT_EQ(SideOfPlane(p[3], p[1], p[2], p[0]), -side);
    EXPECT_EQ(SideOfPlane(p[1], p[2], p[0], p[3]), side);
  }
  EXPECT_GT(zeros, support::Tries(100));
}

// Integer arithmetic decides small lattice tetrahedra.
TEST(SideOfPlane, AgreesWithIntegers) {
  std::mt19937 random(6);
  for (int trial = 0; trial < support::Tries(50'000); ++trial) {
    long long v[4][3];
    Vec3 p[4];
    for (int k = 0; k < 4; ++k) {
      for (long long& coordinate : v[k]) coordinate = static_cast<int>(random() % 9) - 4;
      p[k] = {static_cast<double>(v[k][0]), static_cast<double>(v[k][1]),
              static_cast<double>(v[k][2])};
    }
    long long d[3][3];
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) d[k][axis] = v[k + 1][axis] - v[0][axis];
    }
    const long long determinant = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                                  d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                                  d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    EXPECT_EQ(SideOfPlane(p[0], p[1], p[2], p[3]), (determinant > 0) - (determinant < 0));
  }
}

TEST(TriangleContact, DecidesSegments) {
  const std::array<Vec3, 3> abc{Vec3{0, 0, 0}, Vec3{4, 0, 0}, Vec3{0, 4, 0}};
  EXPECT_TRUE(SegmentTouchesTriangle({1, 1, -1}, {1, 1, 1}, abc));
  EXPECT_TRUE(SegmentTouchesTriangle({2, 2, -1}, {2, 2, 1}, abc));   // On a side.
  EXPECT_TRUE(SegmentTouchesTriangle({0, 0, 0}, {-1, -1, 5}, abc));  // At a corner.
  EXPECT_TRUE(SegmentTouchesTriangle({-1, 1, 0}, {9, 1, 0}, abc));   // In the plane.
  EXPECT_TRUE(SegmentTouchesTriangle({1, 1, 0}, {1.5, 1, 0}, abc));  // Inside.
  EXPECT_TRUE(SegmentTouchesTriangle({4, 0, 0}, {5, 0, 0}, abc));    // End at a corner.
  EXPECT_FALSE(SegmentTouchesTriangle({3, 3, -1}, {3, 3, 1}, abc));
  EXPECT_FALSE(SegmentTouchesTriangle({1, 1, 1}, {1, 1, 2}, abc));
  EXPECT_FALSE(SegmentTouchesTriangle({5, 0, 0}, {6, 0, 0}, abc));
  EXPECT_FALSE(SegmentTouchesTriangle({4, .5, 0}, {.5, 4, 0}, abc));
}

}  // namespace
}  // namespace partiemc
