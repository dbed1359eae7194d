#include "partiemc/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "check/side_balance.h"
#include "mesh/triangulate.h"
#include "region_shapes.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::RandomEngine;
using support::Rectangle;
using support::Reversed;
using ::testing::HasSubstr;
using ::testing::StartsWith;

void AddRing(const std::vector<Point>& ring, std::uint32_t outer, Rings& rings) {
  if (rings.offsets.empty()) rings.offsets.push_back(0);
  for (const Point& point : ring) rings.points.insert(rings.points.end(), {point.x, point.y});
  rings.offsets.push_back(static_cast<std::uint32_t>(rings.PointCount()));
  rings.outer_of.push_back(outer);
}

void FillWithTriangles(Result& result) {
  result.mesh.points = result.rings.points;
  std::vector<std::uint32_t> loop_points;
  for (std::uint32_t i = 0; i < result.rings.PointCount(); ++i) loop_points.push_back(i);
  Triangulator triangulator;
  ASSERT_TRUE(triangulator.Triangulate(result.mesh.points, loop_points, result.rings.offsets,
                                       result.mesh.triangles));
  result.mesh.classes.assign(result.mesh.triangles.size() / 3, TriangleClass::kInterior);
}

/// A square with two holes and an island in the first hole, and a separate square.
Result GoodResult(double shift = 0) {
  Result result;
  std::vector<std::vector<Point>> rings{Rectangle(0, 0, 10, 10), Reversed(Rectangle(1, 1, 5, 9)),
                                        Reversed(Rectangle(6, 1, 9, 9)), Rectangle(2, 2, 4, 8),
                                        Rectangle(20, 0, 30, 10)};
  const std::vector<std::uint32_t> outer_of{kNoRing, 0, 0, kNoRing, kNoRing};
  for (std::size_t k = 0; k < rings.size(); ++k) {
    for (Point& point : rings[k]) point = {point.x + shift, point.y - shift};
    AddRing(rings[k], outer_of[k], result.rings);
  }
  FillWithTriangles(result);
  return result;
}

void ExpectBroken(const Result& result, const std::string& guarantee) {
  const absl::Status status = Validate(result);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), StartsWith(guarantee + ": "));
}

TEST(Validate, GoodResultPassesNearAndFarFromTheOrigin) {
  EXPECT_EQ(Validate(GoodResult()), absl::OkStatus());
  EXPECT_EQ(Validate(GoodResult(1e9)), absl::OkStatus());
  EXPECT_EQ(Validate(GoodResult(-1e14 / 3)), absl::OkStatus());
}

TEST(Validate, EmptyResultAndRingsWithoutMeshPass) {
  Result result;
  EXPECT_EQ(Validate(result), absl::OkStatus());
  result.Clear();
  EXPECT_EQ(Validate(result), absl::OkStatus());
  result = GoodResult();
  result.mesh.Clear();
  EXPECT_EQ(Validate(result), absl::OkStatus());
}

TEST(Validate, ContoursOfRandomFieldsPass) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    RandomEngine random(seed);
    const support::Region contours = support::RandomContours(random, 20 + seed);
    Result result;
    for (std::size_t k = 0; k < contours.LoopCount(); ++k) {
      // Without holes there is nothing to assign.
      if (support::DoubleArea(contours.Loop(k)) < 0) continue;
      result.rings = {};
      result.mesh.Clear();
      AddRing(contours.Loop(k), kNoRing, result.rings);
      FillWithTriangles(result);
      EXPECT_EQ(Validate(result), absl::OkStatus()) << "seed " << seed << ", ring " << k;
    }
  }
}

TEST(Validate, R1FindsWrongArrays) {
  Result result = GoodResult();
  result.rings.points.pop_back();
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.offsets[2] = 0xffffffff;
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.offsets.back() += 1;
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.offsets.clear();
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.outer_of.pop_back();
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.measures.resize(2);
  ExpectBroken(result, "R1");
  result = GoodResult();
  result.rings.normals.resize(2);
  ExpectBroken(result, "R1");
}

TEST(Validate, R1FindsRingOfTwoPoints) {
  Result result;
  AddRing({{0, 0}, {1, 0}}, kNoRing, result.rings);
  ExpectBroken(result, "R1");
}

TEST(Validate, R1FindsPointThatIsNotFinite) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
    Result result = GoodResult();
    result.rings.points[7] = bad;
    ExpectBroken(result, "R1");
  }
}

TEST(Validate, R1FindsRepeatedPoint) {
  Result result;
  AddRing({{0, 0}, {2, 0}, {2, 2}, {0, 2}, {0, 0}}, kNoRing, result.rings);
  ExpectBroken(result, "R1");
}

TEST(Validate, R2FindsAndNamesCrossing) {
  Result result;
  AddRing(Rectangle(5, 0, 6, 1), kNoRing, result.rings);
  AddRing({{0, 0}, {2, 0}, {2, 2}, {1, -1}}, kNoRing, result.rings);
  ExpectBroken(result, "R2");
  EXPECT_THAT(std::string(Validate(result).message()), HasSubstr("point 4 of ring 1"));
}

TEST(Validate, R2FindsRingsThatTouchAtAPoint) {
  Result result;
  AddRing(Rectangle(0, 0, 1, 1), kNoRing, result.rings);
  AddRing(Rectangle(1, 1, 2, 2), kNoRing, result.rings);
  ExpectBroken(result, "R2");
}

TEST(Validate, R3FindsWrongDirections) {
  Result result;
  AddRing(Reversed(Rectangle(0, 0, 1, 1)), kNoRing, result.rings);
  ExpectBroken(result, "R3");
  result = {};
  AddRing(Rectangle(0, 0, 9, 9), kNoRing, result.rings);
  AddRing(Rectangle(1, 1, 2, 2), 0, result.rings);
  ExpectBroken(result, "R3");
}

TEST(Validate, R4FindsHoleThatNamesNoOuterRing) {
  for (const std::uint32_t outer : {1u, 2u, 5u, 77u}) {
    Result result = GoodResult();
    result.rings.outer_of[2] = outer;
    ExpectBroken(result, "R4");
  }
}

TEST(Validate, R4FindsHoleThatNamesAnotherOuterRing) {
  for (const std::uint32_t outer : {3u, 4u}) {
    Result result = GoodResult();
    result.rings.outer_of[1] = outer;
    ExpectBroken(result, "R4");
  }
}

TEST(Validate, R4FindsHoleOutsideAndOuterRingInside) {
  Result result;
  AddRing(Rectangle(0, 0, 9, 9), kNoRing, result.rings);
  AddRing(Reversed(Rectangle(11, 1, 12, 2)), 0, result.rings);
  ExpectBroken(result, "R4");
  EXPECT_THAT(std::string(Validate(result).message()), HasSubstr("ring 1, a hole"));
  result = {};
  AddRing(Rectangle(0, 0, 9, 9), kNoRing, result.rings);
  AddRing(Rectangle(1, 1, 2, 2), kNoRing, result.rings);
  ExpectBroken(result, "R4");
  EXPECT_THAT(std::string(Validate(result).message()), HasSubstr("ring 1, an outer ring"));
}

TEST(Validate, M1FindsWrongArrays) {
  Result result = GoodResult();
  result.mesh.classes.pop_back();
  ExpectBroken(result, "M1");
  result = GoodResult();
  result.mesh.triangles.pop_back();
  ExpectBroken(result, "M1");
  result = GoodResult();
  result.mesh.points.push_back(0);
  ExpectBroken(result, "M1");
  result = GoodResult();
  result.mesh.triangles[4] = 1000;
  ExpectBroken(result, "M1");
}

TEST(Validate, M1FindsPointThatIsNotFinite) {
  Result result = GoodResult();
  result.mesh.points.insert(result.mesh.points.end(),
                            {0.0, std::numeric_limits<double>::quiet_NaN()});
  ExpectBroken(result, "M1");
}

TEST(Validate, M1FindsClockwiseAndDegenerateTriangles) {
  Result result = GoodResult();
  std::swap(result.mesh.triangles[0], result.mesh.triangles[1]);
  ExpectBroken(result, "M1");
  result = GoodResult();
  result.mesh.triangles[0] = result.mesh.triangles[1];
  ExpectBroken(result, "M1");
}

TEST(Validate, M2FindsMissingAndSurplusTriangle) {
  Result result = GoodResult();
  result.mesh.triangles.resize(result.mesh.triangles.size() - 3);
  result.mesh.classes.pop_back();
  ExpectBroken(result, "M2");
  result = GoodResult();
  for (int i = 0; i < 3; ++i) result.mesh.triangles.push_back(result.mesh.triangles[i]);
  result.mesh.classes.push_back(TriangleClass::kInterior);
  ExpectBroken(result, "M2");
  result = GoodResult();
  result.mesh.triangles.clear();
  result.mesh.classes.clear();
  ExpectBroken(result, "M2");
}

TEST(Validate, M2FindsOverlapAsLargeAsAGap) {
  Result result;
  AddRing(Rectangle(0, 0, 1, 1), kNoRing, result.rings);
  FillWithTriangles(result);
  ASSERT_EQ(result.mesh.triangles.size(), 6u);
  for (std::size_t i = 0; i < 3; ++i) result.mesh.triangles[i] = result.mesh.triangles[i + 3];
  ExpectBroken(result, "M2");
}

TEST(Validate, M2AllowsTJunctionsAlongTheAxes) {
  // A square as two rectangles side by side on top of a third.
  Result result;
  AddRing(Rectangle(0, 0, 2, 2), kNoRing, result.rings);
  result.mesh.points = result.rings.points;
  result.mesh.points.insert(result.mesh.points.end(), {0, 1, 2, 1, 0.7, 1, 0.7, 2});
  result.mesh.triangles = {0, 1, 5, 0, 5, 4, 4, 6, 7, 4, 7, 3, 6, 5, 2, 6, 2, 7};
  result.mesh.classes.assign(6, TriangleClass::kInterior);
  EXPECT_EQ(Validate(result), absl::OkStatus());
  // A missing sliver, far below the tolerance of areas.
  result.mesh.points[13] = std::nextafter(1.0, 2.0);
  ExpectBroken(result, "M2");
}

TEST(Validate, M3FindsMissingAndChangedPoint) {
  Result result = GoodResult();
  result.mesh.points.resize(result.mesh.points.size() - 2);
  result.mesh.triangles.resize(3);
  result.mesh.classes.resize(1);
  ExpectBroken(result, "M3");
  result = GoodResult();
  result.mesh.points[1] = -0.0;
  ExpectBroken(result, "M3");
  result = GoodResult();
  result.mesh.points[2] = std::nextafter(result.mesh.points[2], 1.0);
  ExpectBroken(result, "M3");
}

TEST(Validate, RefusesGarbage) {
  RandomEngine random(12);
  for (int round = 0; round < support::Tries(20'000); ++round) {
    Result result = GoodResult();
    Rings& rings = result.rings;
    Mesh& mesh = result.mesh;
    for (int change = 0; change < 3; ++change) {
      const auto index = static_cast<std::uint32_t>(random() % 3 == 0 ? random() : random() % 9);
      switch (random() % 6) {
        case 0:
          rings.offsets[random() % rings.offsets.size()] = index;
          break;
        case 1:
          rings.outer_of[random() % rings.outer_of.size()] = index;
          break;
        case 2:
          rings.points[random() % rings.points.size()] =
              std::ldexp(1.0, static_cast<int>(index % 3000) - 1500);
          break;
        case 3:
          mesh.triangles[random() % mesh.triangles.size()] = index;
          break;
        case 4:
          mesh.points.resize(random() % (mesh.points.size() + 1));
          break;
        case 5:
          rings.points.resize(1 + random() % rings.points.size());
          break;
      }
      if (mesh.points.empty()) mesh.points.resize(2);
    }
    if (result == GoodResult()) continue;
    const absl::Status status = Validate(result);
    // Rings may stay valid after a point changed, but the mesh does not fit them any more.
    EXPECT_FALSE(status.ok()) << "seed 12, round " << round;
  }
}

TEST(SideBalance, SidesCancelPiecewiseOnlyAlongAxes) {
  SideBalance sides;
  EXPECT_EQ(sides.Take().imbalance, std::nullopt);
  sides.Add({0, 0}, {2, 1}), sides.Add({2, 1}, {0, 0});
  EXPECT_EQ(sides.Take().imbalance, std::nullopt);
  sides.Add({0, 0}, {2, 0}), sides.Add({2, 0}, {1, 0}), sides.Add({1, 0}, {0, 0});
  sides.Add({3, 0}, {3, 5}), sides.Add({3, 5}, {3, 1}), sides.Add({3, 1}, {3, 0});
  EXPECT_EQ(sides.Take().imbalance, std::nullopt);
  sides.Add({0, 0}, {2, 0}), sides.Add({2, 0}, {1, 0});
  EXPECT_EQ(sides.Take().imbalance, (Point{0, 0}));
  sides.Add({0, 0}, {2, 2}), sides.Add({2, 2}, {1, 1}), sides.Add({1, 1}, {0, 0});
  EXPECT_TRUE(sides.Take().imbalance.has_value()) << "slanted sides must match whole";
  EXPECT_EQ(sides.Take().imbalance, std::nullopt) << "nothing is left over";
}

}  // namespace
}  // namespace partiemc
