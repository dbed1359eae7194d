// Tests that rings through the roots of `virtual-plane` are simple and nested (core/METHOD.md, "Why
// rings are simple"). Uses adversarial level sets, arbitrary vertices, edge vertices thinned in
// every pattern, and the repair, which relies on it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/internal/research.h"
#include "partiemc/validate.h"
#include "support/level_sets.h"
#include "support/stages.h"
#include "support/tries.h"
#include "vertices/placement.h"
#include "vertices/repair.h"
#include "vertices/virtual_plane.h"

namespace partiemc {
namespace {

using support::Random;
using support::Stages;

// Positions of the lattice: around the origin, within one tile, and at the limit of positions.
constexpr TileCoordinate kPlaces[] = {{0, 0}, {7, -13}, {(1 << 25) - 2, (1 << 25) - 2}};

// Stages 3 and 4 of a random patch of 12 x 12 nodes across the corner of four tiles, or within one.
void TraceRandomPatch(Random& random, Stages& stages) {
  const support::LevelSetPatch patch = support::RandomPatch(random, 12, 12);
  const TileCoordinate low = kPlaces[random.Below(3)];
  const int tiles = random.Chance(0.25) ? 1 : 0;
  const int offset = tiles == 1 ? 26 : 10;
  const int x0 = 32 * low.x + offset, y0 = 32 * low.y + offset;
  constexpr double kSpacings[] = {1, 0.0303, 1e-9, 1e7};
  stages.TraceOn([&](int x, int y) { return patch.At(x - x0, y - y0); }, low,
                 {low.y + tiles, low.x + tiles}, {},
                 {.spacing = kSpacings[random.Below(4)], .clean = false});
}

// The steps from a vertex to its root. A test leaves out one of them to see that it is needed.
enum class Clamping {
  kWhole,     // As the placement does.
  kNone,      // The vertex stays where the Newton step put it.
  kCellOnly,  // Into its cell, but in saddles not into the half of its segment.
  kToSides,   // Into its cell, up to its very sides.
  kToNodes,   // As the placement does, but crossings of lattice edges up to their very nodes.
};

Point Clamped(const Stages& stages, std::uint32_t segment, Point point, Clamping clamping) {
  if (clamping == Clamping::kNone) return point;
  const ActiveCell& cell = stages.crossings.cells[stages.crossings.segments[segment].cell];
  if (clamping == Clamping::kWhole || clamping == Clamping::kToNodes) {
    return ClampToCell(stages.bins.tiles, cell, stages.crossings.segments[segment], point);
  }
  const Point origin = CellOrigin(stages.bins.tiles, cell);
  const double margin = clamping == Clamping::kToSides ? 0 : 1.0 / 1024;
  return {origin.x + std::clamp(point.x - origin.x, margin, 1 - margin),
          origin.y + std::clamp(point.y - origin.y, margin, 1 - margin)};
}

// The crossing of a segment's entry edge, not kept away from the nodes.
Point BareCrossing(const Stages& stages, const Segment& segment) {
  const ActiveCell& cell = stages.crossings.cells[segment.cell];
  const std::array<double, 4> f = stages.CornerValues(cell);
  const int a = segment.entry, b = (segment.entry + 1) % 4;
  const double t = f[a] / (f[a] - f[b]);
  const Point origin = CellOrigin(stages.bins.tiles, cell);
  return {origin.x + kCornerX[a] + t * (kCornerX[b] - kCornerX[a]),
          origin.y + kCornerY[a] + t * (kCornerY[b] - kCornerY[a])};
}

// Target positions of the cell vertices.
enum class Aim { kNewton, kAnywhere, kCorners, kOnePoint, kCount };

Point Aimed(Random& random, Aim aim, const CellPlane& plane, Point target) {
  const Point& p = plane.point;
  switch (aim) {
    case Aim::kAnywhere:
      return {p.x + random.Uniform(-3, 3), p.y + random.Uniform(-3, 3)};
    case Aim::kCorners:
      return {std::round(p.x + random.Uniform(-1, 1)), std::round(p.y + random.Uniform(-1, 1))};
    case Aim::kOnePoint:
      return target;
    case Aim::kNewton:
    case Aim::kCount:
      break;
  }
  return VirtualPlaneVertex(plane, VirtualPlaneConstants{}.newton_step);
}

// The plane of a segment with an arbitrary value and gradient, from weak to extremely large,
// unrelated to the level set.
CellPlane RandomPlane(Random& random, const Stages& stages, const Segment& segment) {
  const ActiveCell& cell = stages.crossings.cells[segment.cell];
  CellPlane plane;
  plane.entry = EdgeCrossing(stages.bins.tiles, stages.level_set, cell, segment.entry);
  plane.exit = EdgeCrossing(stages.bins.tiles, stages.level_set, cell, segment.exit);
  plane.point = {(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
  const double slope = std::pow(10, random.Uniform(-2, 6));
  const double angle = random.Uniform(0, 6.2832);
  plane.gradient_x = static_cast<float>(slope * std::cos(angle));
  plane.gradient_y = static_cast<float>(slope * std::sin(angle));
  plane.value = static_cast<float>(random.Uniform(-1, 1) * std::pow(10, random.Uniform(-9, 9)));
  plane.is_weak = random.Chance(0.1);
  return plane;
}

// Rings through the roots, of which edge vertices are kept with a probability.
void RingsThroughRoots(Random& random, const Stages& stages, Clamping clamping, Rings& rings) {
  const RingTopology& topology = stages.topology;
  const double cell_size = stages.scale.cell_size;
  constexpr double kShares[] = {0, 0.1, 0.5, 0.9, 1};
  const double kept = kShares[random.Below(5)];
  const auto aim = static_cast<Aim>(random.Below(static_cast<std::size_t>(Aim::kCount)));
  const Point corner = topology.segments.empty()
                           ? Point{}
                           : CellOrigin(stages.bins.tiles, stages.crossings.cells[0]);
  const Point target{corner.x + static_cast<double>(random.Below(12)) - 6,
                     corner.y + static_cast<double>(random.Below(12))};
  rings.Clear();
  const auto add = [&](Point point) {
    rings.points.push_back(point.x * cell_size);
    rings.points.push_back(point.y * cell_size);
  };
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    for (std::size_t k = topology.offsets[ring]; k < topology.offsets[ring + 1]; ++k) {
      const std::uint32_t segment = topology.segments[k];
      const Segment& ends = stages.crossings.segments[segment];
      const CellPlane plane = RandomPlane(random, stages, ends);
      if (random.Chance(kept)) {
        add(clamping == Clamping::kToNodes ? BareCrossing(stages, ends) : plane.entry);
      }
      add(Clamped(stages, segment, Aimed(random, aim, plane, target), clamping));
    }
    rings.offsets.push_back(static_cast<std::uint32_t>(rings.PointCount()));
  }
  rings.outer_of = topology.outer_of;
}

TEST(Roots, RingsAreSimpleAndNestedForAnyLevelSet) {
  Stages stages;
  Result result;
  std::size_t rings = 0, saddles = 0, thinned = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(20'000u); ++seed) {
    Random random(seed);
    TraceRandomPatch(random, stages);
    RingsThroughRoots(random, stages, Clamping::kWhole, result.rings);
    const absl::Status valid = Validate(result, Fill::kNone);
    ASSERT_TRUE(valid.ok()) << "seed " << seed << ": " << valid;
    rings += result.rings.RingCount();
    for (const ActiveCell& cell : stages.crossings.cells) saddles += cell.IsSaddle();
    thinned += 2 * stages.topology.segments.size() - result.rings.PointCount();
  }
  // The test covered the cases of the argument.
  EXPECT_GT(rings, support::Tries(100'000u));
  EXPECT_GT(saddles, support::Tries(100'000u));
  EXPECT_GT(thinned, 100'000u);
}

// The test above fails soon if any clamp is left out.
class RootsWithout : public testing::TestWithParam<Clamping> {};

TEST_P(RootsWithout, AnyClampCrossOrTouch) {
  Stages stages;
  Result result;
  std::size_t broken = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(500u); ++seed) {
    Random random(seed);
    TraceRandomPatch(random, stages);
    RingsThroughRoots(random, stages, GetParam(), result.rings);
    broken += !Validate(result, Fill::kNone).ok();
  }

  EXPECT_GT(broken, support::Tries(100u));  // Seen: 490, 346, 428 and 208.
}

std::string ClampingName(const testing::TestParamInfo<Clamping>& tested) {
  constexpr const char* kNames[] = {"", "Any", "TheSaddles", "TheMargin", "TheMarginOfNodes"};
  return kNames[static_cast<int>(tested.param)];
}

INSTANTIATE_TEST_SUITE_P(Clamps, RootsWithout,
                         testing::Values(Clamping::kNone, Clamping::kCellOnly, Clamping::kToSides,
                                         Clamping::kToNodes),
                         ClampingName);

// Points moved at random, far over other rings. The repair ends with simple, nested rings, because
// it can always return to the roots.
TEST(Roots, RepairReturnsFromAnywhere) {
  Stages stages;
  Result result;
  RepairScratch scratch;
  std::size_t crossing = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(2'000u); ++seed) {
    Random random(seed);
    TraceRandomPatch(random, stages);
    RingsThroughRoots(random, stages, Clamping::kWhole, result.rings);
    const std::vector<double> roots = result.rings.points;
    const double reach = stages.scale.cell_size * std::pow(10, random.Uniform(-1, 1));
    const double share = random.Chance(0.5) ? 1 : 0.1;
    for (std::size_t k = 0; k < roots.size(); k += 2) {
      if (!random.Chance(share)) continue;
      result.rings.points[k] += random.Uniform(-reach, reach);
      result.rings.points[k + 1] += random.Uniform(-reach, reach);
    }
    const std::vector<std::uint8_t> near_walls(seed % 2 == 0 ? roots.size() / 2 : 0, 1);
    crossing += CountTouchingPairs(result.rings.points, result.rings.offsets, scratch.pairs) > 0;
    ASSERT_TRUE(RepairRings(roots, near_walls, scratch, result.rings)) << "seed " << seed;
    const absl::Status valid = Validate(result, Fill::kNone);
    ASSERT_TRUE(valid.ok()) << "seed " << seed << ": " << valid;
  }
  EXPECT_GT(crossing, support::Tries(1'000u));
}

// The placement itself, on level sets that contradict the particles, so that gradients are
// arbitrary.
TEST(Roots, PlacementIsSimpleWithAnyEdgeVertices) {
  Stages stages;
  std::size_t points = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(200u); ++seed) {
    Random random(seed);
    const support::LevelSetPatch patch = support::RandomPatch(random, 24, 24);
    const support::Particles particles = support::Shifted(
        support::Noise(random, 1 + random.Below(400), 14), 32 + random.Uniform(-2, 2), 32);
    const auto value = [&](int x, int y) { return patch.At(x - 20, y - 20); };
    stages.RunOn(value, {0, 0}, {1, 1}, particles, {.spacing = 1.0, .clean = false});
    const absl::Status valid = Validate(stages.result, Fill::kGreedy);
    ASSERT_TRUE(valid.ok()) << "seed " << seed << ": " << valid;
    for (const double kept : {0.0, 0.5, 1.0}) {
      Result result;
      for (std::size_t ring = 0; ring < stages.topology.RingCount(); ++ring) {
        for (std::size_t i = 2 * stages.topology.offsets[ring];
             i < 2 * stages.topology.offsets[ring + 1]; ++i) {
          if (i % 2 == 0 && !random.Chance(kept)) continue;
          result.rings.points.push_back(stages.vertex_scratch.vertices.root[i].x);
          result.rings.points.push_back(stages.vertex_scratch.vertices.root[i].y);
        }
        result.rings.offsets.push_back(static_cast<std::uint32_t>(result.rings.PointCount()));
      }
      result.rings.outer_of = stages.topology.outer_of;
      const absl::Status rooted = Validate(result, Fill::kNone);
      ASSERT_TRUE(rooted.ok()) << "seed " << seed << ", kept " << kept << ": " << rooted;
      points += result.rings.PointCount();
    }
  }
  EXPECT_GT(points, 50'000u);
}

}  // namespace
}  // namespace partiemc
