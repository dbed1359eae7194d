// Guarantee M4, no T-junctions, compared with brute force and with planted T-junctions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/point.h"
#include "base/predicates.h"
#include "partiemc/validate.h"
#include "support/particles.h"
#include "support/reconstruct.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using ::testing::StartsWith;

// The rings of a square of side 2.
Result SquareRings() {
  Result result;
  result.rings.points = {0, 0, 2, 0, 2, 2, 0, 2};
  result.rings.offsets = {0, 4};
  result.rings.outer_of = {kNoRing};
  return result;
}

Point PointAt(const std::vector<double>& points, std::size_t k) {
  return {points[2 * k], points[2 * k + 1]};
}

bool IsInside(const Point& a, const Point& b, const Point& p) {
  if (p == a || p == b || Orientation(a, b, p) != 0) return false;
  return SweepsBefore(a, p) == SweepsBefore(p, b);
}

// Compares every vertex with every side of a triangle and every segment of a ring.
std::size_t CountTJunctionsByBruteForce(const Result& result) {
  const Rings& rings = result.rings;
  const Mesh& mesh = result.mesh;
  std::vector<std::pair<Point, Point>> sides;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    sides.emplace_back(PointAt(mesh.points, mesh.triangles[k]),
                       PointAt(mesh.points, mesh.triangles[k % 3 == 2 ? k - 2 : k + 1]));
  }
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::size_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      const std::size_t next = k + 1 < rings.offsets[ring + 1] ? k + 1 : rings.offsets[ring];
      sides.emplace_back(PointAt(rings.points, k), PointAt(rings.points, next));
    }
  }
  std::size_t count = 0;
  for (std::size_t vertex = 0; vertex < mesh.PointCount(); ++vertex) {
    const Point p = PointAt(mesh.points, vertex);
    count += std::ranges::any_of(
        sides, [&](const auto& side) { return IsInside(side.first, side.second, p); });
  }
  return count;
}

TEST(TJunctions, M4FindsVertexInsideASide) {
  // A square as two rectangles side by side on top of a third: one vertex inside its upper side,
  // three inside sides of the ring.
  Result result = SquareRings();
  result.mesh.points = result.rings.points;
  result.mesh.points.insert(result.mesh.points.end(), {0, 1, 2, 1, 0.7, 1, 0.7, 2});
  result.mesh.triangles = {0, 1, 5, 0, 5, 4, 4, 6, 7, 4, 7, 3, 6, 5, 2, 6, 2, 7};
  result.mesh.classes.assign(6, TriangleClass::kInterior);
  EXPECT_EQ(CountTJunctions(result), 4u);
  EXPECT_EQ(CountTJunctionsByBruteForce(result), 4u);
  for (const Fill fill : {Fill::kNone, Fill::kGrid, Fill::kGreedy}) {
    EXPECT_EQ(Validate(result, fill), absl::OkStatus()) << Name(fill);
  }
  for (const Fill fill : {Fill::kConforming, Fill::kPolygon}) {
    const absl::Status status = Validate(result, fill);
    EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
    EXPECT_THAT(std::string(status.message()), StartsWith("M4: 4 vertices lie inside sides"));
  }
}

TEST(TJunctions, FilledResultNeedsAMesh) {
  Result result = SquareRings();
  result.mesh.points = result.rings.points;
  result.mesh.triangles = {0, 1, 2, 0, 2, 3};
  result.mesh.classes.assign(2, TriangleClass::kInterior);
  EXPECT_EQ(Validate(result, Fill::kConforming), absl::OkStatus());
  result.mesh.Clear();
  EXPECT_EQ(Validate(result, Fill::kNone), absl::OkStatus());
  EXPECT_EQ(Validate(result, Fill::kConforming).code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Validate(Result{}, Fill::kConforming), absl::OkStatus());
}

// Frames of all kinds. `conforming` and `polygon` have no T-junction by either count; for `greedy`
// both counts agree.
TEST(TJunctions, AgreeWithBruteForceInRandomFrames) {
  std::size_t greedy_total = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(40u); ++seed) {
    support::Random random(seed);
    const support::Particles particles = support::Blob(random, 4 + 0.2 * static_cast<double>(seed));
    for (const Placement placement :
         {Placement::kMarchingSquares, Placement::kQef, Placement::kVirtualPlane}) {
      for (const Fill fill : {Fill::kGrid, Fill::kGreedy, Fill::kConforming, Fill::kPolygon}) {
        const Result result = support::ReconstructOnce(
            {.placement = placement, .fill = fill, .spacing = 1.0}, particles);
        ASSERT_EQ(Validate(result, fill), absl::OkStatus()) << "seed " << seed;
        const std::size_t expected = CountTJunctionsByBruteForce(result);
        EXPECT_EQ(CountTJunctions(result), expected) << "seed " << seed << ", " << Name(fill);
        if (fill == Fill::kConforming || fill == Fill::kPolygon) {
          EXPECT_EQ(expected, 0u);
        } else {
          EXPECT_EQ(Validate(result, Fill::kConforming).ok(), expected == 0);
        }
        if (fill == Fill::kGreedy) greedy_total += expected;
      }
    }
  }
  EXPECT_GT(greedy_total, support::Tries(1000u));
}

// A vertex planted in the middle of one side of a conforming mesh. Only the triangle on one side is
// split there.
TEST(TJunctions, M4FindsPlantedTJunction) {
  support::Random random(3);
  const Result good = support::ReconstructOnce(
      {.placement = Placement::kMarchingSquares, .fill = Fill::kConforming, .spacing = 1.0},
      support::Blob(random, 9));
  ASSERT_EQ(Validate(good, Fill::kConforming), absl::OkStatus());
  int planted = 0;
  for (std::size_t k = 0; k < good.mesh.triangles.size(); k += 7) {
    const std::size_t next = k % 3 == 2 ? k - 2 : k + 1;
    const std::size_t opposite = k - k % 3 + (k % 3 + 2) % 3;
    const Point a = PointAt(good.mesh.points, good.mesh.triangles[k]);
    const Point b = PointAt(good.mesh.points, good.mesh.triangles[next]);
    // Other sides belong to rings, or are slanted and do not contain their rounded middle.
    if (good.mesh.classes[k / 3] != TriangleClass::kInterior) continue;
    if (a.x != b.x && a.y != b.y) continue;
    Result result = good;
    const auto middle = static_cast<std::uint32_t>(result.mesh.PointCount());
    result.mesh.points.push_back((a.x + b.x) / 2);
    result.mesh.points.push_back((a.y + b.y) / 2);
    result.mesh.triangles[next] = middle;
    for (const std::uint32_t corner :
         {middle, good.mesh.triangles[next], good.mesh.triangles[opposite]}) {
      result.mesh.triangles.push_back(corner);
    }
    result.mesh.classes.push_back(TriangleClass::kInterior);
    EXPECT_EQ(Validate(result), absl::OkStatus());
    EXPECT_EQ(CountTJunctions(result), 1u);
    EXPECT_THAT(std::string(Validate(result, Fill::kConforming).message()), StartsWith("M4: "));
    ++planted;
  }
  EXPECT_GT(planted, 5);
}

}  // namespace
}  // namespace partiemc
