#include "vertices/repair.h"

#include <gtest/gtest.h>

#include <vector>

#include "vertices/measure.h"

namespace partiemc {
namespace {

// Rings of given points; the first `outers` are outer rings, the others holes of the first.
Rings RingsOf(const std::vector<std::vector<double>>& rings, std::size_t outers) {
  Rings result;
  for (std::size_t ring = 0; ring < rings.size(); ++ring) {
    result.points.insert(result.points.end(), rings[ring].begin(), rings[ring].end());
    result.offsets.push_back(static_cast<std::uint32_t>(result.PointCount()));
    result.outer_of.push_back(ring < outers ? kNoRing : 0);
  }
  return result;
}

std::vector<double> Square(double x, double y, double half) {
  return {x - half, y - half, x + half, y - half, x + half, y + half, x - half, y + half};
}

std::vector<double> Reversed(const std::vector<double>& ring) {
  std::vector<double> result;
  for (std::size_t k = ring.size(); k >= 2; k -= 2) {
    result.insert(result.end(), {ring[k - 2], ring[k - 1]});
  }
  return result;
}

// Moves `rings` from `roots` and repairs them. Checks that nothing crosses and that the measures
// are up to date.
Rings Repaired(const Rings& roots, Rings rings) {
  RepairScratch scratch;
  EXPECT_TRUE(RepairRings(roots.points, {}, scratch, rings));
  EXPECT_EQ(CountTouchingPairs(rings.points, rings.offsets, scratch.pairs), 0u);
  EXPECT_EQ(rings.measures.size(), rings.RingCount());
  for (std::size_t ring = 0; ring < rings.measures.size(); ++ring) {
    EXPECT_EQ(rings.measures[ring], MeasureRing(rings.RingPoints(ring))) << "ring " << ring;
  }
  return rings;
}

TEST(Repair, LeavesCorrectRingsUnchanged) {
  const Rings roots = RingsOf({Square(0, 0, 10), Reversed(Square(0, 0, 3))}, 1);
  const Rings moved = RingsOf({Square(0, 0, 10.5), Reversed(Square(0.5, 0, 2))}, 1);
  EXPECT_EQ(Repaired(roots, moved).points, moved.points);
}

TEST(Repair, MovesCrossingSegmentsBackPartly) {
  const Rings roots = RingsOf({Square(0, 0, 1), Square(3, 0, 1)}, 2);
  Rings moved = roots;
  moved.points[2] = 2.1;  // The lower right corner of the first, now inside of the second.
  const Rings repaired = Repaired(roots, moved);
  EXPECT_LT(repaired.points[2], 2.0);
  EXPECT_GT(repaired.points[2], 1.0) << "half way is enough here";
  // The far corners of the second square do not move.
  EXPECT_EQ(repaired.points[8 + 2], 4);
}

TEST(Repair, FindsRingThatAnotherHasPassedOver) {
  // A small ring next to a large one that has grown over it.
  const Rings roots = RingsOf({Square(0, 0, 5), Square(7, 0, 0.5)}, 2);
  Rings moved = roots;
  for (std::size_t k = 0; k < 8; ++k) moved.points[k] *= 2;
  const Rings repaired = Repaired(roots, moved);
  EXPECT_EQ(repaired.points, roots.points);
}

TEST(Repair, FindsIslandThatLeftItsHole) {
  Rings roots = RingsOf({Square(0, 0, 10), Square(0, 0, 1), Reversed(Square(0, 0, 5))}, 2);
  Rings moved = roots;
  for (std::size_t k = 8; k < 16; k += 2) moved.points[k] += 7.5;  // Into the fluid.
  EXPECT_EQ(Repaired(roots, moved).points, roots.points);
}

TEST(Repair, FindsRingTurnedInsideOut) {
  const Rings roots = RingsOf({Square(0, 0, 1)}, 1);
  Rings moved = roots;
  for (double& coordinate : moved.points) coordinate *= -1;  // Half a turn: still fine.
  EXPECT_EQ(Repaired(roots, moved).points, moved.points);
  for (std::size_t k = 0; k < moved.points.size(); k += 2) moved.points[k] = -roots.points[k];
  for (std::size_t k = 1; k < moved.points.size(); k += 2) moved.points[k] = roots.points[k];
  ASSERT_LT(MeasureRing(moved.RingPoints(0)).area, 0);
  EXPECT_EQ(Repaired(roots, moved).points, roots.points);
}

TEST(Repair, FindsOneOfThousandsOfHolesOutsideItsPlate) {
  constexpr int kSide = 60;
  std::vector<std::vector<double>> points{Square(2.0 * kSide, 2.0 * kSide, 2.0 * kSide + 2)};
  for (int k = 0; k < kSide * kSide; ++k) {
    points.push_back(Reversed(Square(4 * (k % kSide) + 2, 4 * (k / kSide) + 2, 1)));
  }
  const Rings roots = RingsOf(points, 1);
  EXPECT_EQ(Repaired(roots, roots).points, roots.points);
  for (const std::size_t ring : {1, 1830, kSide * kSide}) {
    Rings moved = roots;
    for (std::size_t k = 2 * roots.offsets[ring]; k < 2 * roots.offsets[ring + 1]; k += 2) {
      moved.points[k] += 5 * kSide;
    }
    EXPECT_EQ(Repaired(roots, moved).points, roots.points) << "hole " << ring;
  }
}

/// Each round frees one square, which then meets the next one. Without a limit there would be one
/// round for each square.
TEST(Repair, EndsInSimpleRingsAfterTheLastRound) {
  constexpr int kSquares = 200;
  std::vector<std::vector<double>> at_roots, elsewhere;
  for (int k = 0; k < kSquares; ++k) {
    at_roots.push_back(Square(3 * k, 0, 1));
    // Each square takes the position of the next one. The last square stays.
    elsewhere.push_back(k + 1 < kSquares ? Square(3 * k + 3, 0, 1) : Square(3 * k, 0, 1));
  }
  const Rings roots = RingsOf(at_roots, kSquares);
  EXPECT_EQ(Repaired(roots, RingsOf(elsewhere, kSquares)).points, roots.points);
}

TEST(Repair, FailsIfRingsCrossAtTheirRoots) {
  // Two outer rings that cross; an outer ring and its hole.
  const std::vector<Rings> crossing = {
      RingsOf({Square(0, 0, 1), Square(5, 0, 1), Square(1.5, 0, 1)}, 3),
      RingsOf({Square(10, 0, 2), Reversed(Square(11, 0, 2))}, 1)};
  RepairScratch scratch;
  for (const Rings& roots : crossing) {
    Rings rings = roots;
    EXPECT_FALSE(RepairRings(roots.points, {}, scratch, rings));
    EXPECT_EQ(rings.points, roots.points);
  }
  Rings rings = RingsOf({Square(0, 0, 1)}, 1);
  EXPECT_TRUE(RepairRings(std::vector(rings.points), {}, scratch, rings))
      << "with the same scratch";
}

TEST(Repair, FailsIfARingIsMisplacedAtItsRoot) {
  const Rings roots = RingsOf({Square(0, 0, 5), Square(0, 0, 1)}, 2);
  Rings rings = roots;
  RepairScratch scratch;
  EXPECT_FALSE(RepairRings(roots.points, {}, scratch, rings));
}

TEST(Repair, SeparatesCoincidentPoints) {
  const Rings roots = RingsOf({Square(0, 0, 1)}, 1);
  Rings moved = roots;
  moved.points[2] = moved.points[0];
  moved.points[3] = moved.points[1];
  const Rings repaired = Repaired(roots, moved);
  EXPECT_FALSE(repaired.points[2] == repaired.points[0] &&
               repaired.points[3] == repaired.points[1]);
}

}  // namespace
}  // namespace partiemc
