#include "normals/normals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>

#include "support/reconstruct.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::AngleBetween;
using support::Stages;

CellNormal KeyOf(const Stages& stages, std::size_t k) {
  const Point origin = CellOrigin(stages.bins.tiles, CellOf(stages, k));
  CellNormal key;
  key.column = static_cast<std::int32_t>(origin.x);
  key.row = static_cast<std::int32_t>(origin.y);
  return key;
}

std::vector<CellNormal> Reversed(std::vector<CellNormal> normals) {
  for (CellNormal& normal : normals) {
    normal.x = -normal.x;
    normal.y = -normal.y;
  }
  return normals;
}

class NormalsOf : public testing::TestWithParam<Placement> {};

TEST_P(NormalsOf, HalfPlaneAreAcrossItsBoundary) {
  Stages stages;
  stages.Run(support::HalfPlane(41, 12), {.placement = GetParam(), .spacing = 1.0});
  int checked = 0;
  for (const CellPlane& plane : stages.planes) {
    if (plane.point.x < 10 || plane.point.x > 30 || plane.point.y < -3) continue;
    EXPECT_LT(AngleBetween(plane.normal_x, plane.normal_y, 0, 1), 1) << plane.point.x;
    ++checked;
  }
  EXPECT_GE(checked, 20);
}

TEST_P(NormalsOf, DiscPointAwayFromItsCentre) {
  Stages stages;
  stages.Run(support::Disc(14.2), {.placement = GetParam(), .spacing = 1.0});
  double sum = 0;
  for (const CellPlane& plane : stages.planes) {
    const double angle = AngleBetween(plane.normal_x, plane.normal_y, plane.point.x, plane.point.y);
    EXPECT_LT(angle, 20);  // The lattice's steps.
    sum += angle;
    EXPECT_NEAR(std::hypot(plane.normal_x, plane.normal_y), 1, 1e-12);
  }
  EXPECT_LT(sum / static_cast<double>(stages.planes.size()), 7);
}

TEST_P(NormalsOf, VerticesAreUnitAndOutwardForAnyMemory) {
  Stages first;
  first.Run(support::Disc(9.7), {.placement = GetParam(), .spacing = 1.0});
  Stages second;
  second.Run(support::Disc(9.7), {.placement = GetParam(), .spacing = 1.0},
             Reversed(first.next_normals));
  const Rings& rings = second.result.rings;
  ASSERT_EQ(rings.normals.size(), rings.points.size());
  ASSERT_GT(rings.PointCount(), 20u);
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    const double nx = rings.normals[2 * k];
    const double ny = rings.normals[2 * k + 1];
    EXPECT_NEAR(std::hypot(nx, ny), 1, 1e-6);
    EXPECT_LT(AngleBetween(nx, ny, rings.points[2 * k], rings.points[2 * k + 1]), 45);
  }
}

INSTANTIATE_TEST_SUITE_P(Placements, NormalsOf, testing::ValuesIn(AllPlacements()),
                         [](const auto& tested) {
                           std::string name(Name(tested.param));
                           std::erase(name, '-');
                           return name;
                         });

TEST(Normals, AreOrientedByPreviousNormals) {
  Stages first;
  first.Run(support::Disc(9.7), {.spacing = 1.0});
  Stages kept, turned;
  kept.Run(support::Disc(9.7), {.spacing = 1.0}, first.next_normals);
  turned.Run(support::Disc(9.7), {.spacing = 1.0}, Reversed(first.next_normals));
  ASSERT_EQ(turned.planes.size(), first.planes.size());
  for (std::size_t k = 0; k < first.planes.size(); ++k) {
    EXPECT_EQ(kept.planes[k].normal_x, first.planes[k].normal_x);
    EXPECT_EQ(kept.planes[k].normal_y, first.planes[k].normal_y);
    if (CellOf(first, k).IsSaddle()) continue;  // Remembers nothing.
    EXPECT_EQ(turned.planes[k].normal_x, -first.planes[k].normal_x);
    EXPECT_EQ(turned.planes[k].normal_y, -first.planes[k].normal_y);
  }
}

TEST(Normals, IgnorePreviousNormalsWithoutMemory) {
  Stages first, second;
  first.Run(support::Disc(9.7), {.spacing = 1.0});
  second.Run(support::Disc(9.7), {.spacing = 1.0, .normal_memory = false},
             Reversed(first.next_normals));
  for (std::size_t k = 0; k < first.planes.size(); ++k) {
    EXPECT_EQ(second.planes[k].normal_x, first.planes[k].normal_x);
    EXPECT_EQ(second.planes[k].normal_y, first.planes[k].normal_y);
  }
}

TEST(Normals, PreviousNormalsOfInactiveCellsHaveNoEffect) {
  Stages first, second;
  first.Run(support::Disc(9.7), {.spacing = 1.0});
  std::vector<CellNormal> elsewhere = Reversed(first.next_normals);
  for (CellNormal& normal : elsewhere) normal.column += 100;
  second.Run(support::Disc(9.7), {.spacing = 1.0}, elsewhere);
  for (std::size_t k = 0; k < first.planes.size(); ++k) {
    EXPECT_EQ(second.planes[k].normal_x, first.planes[k].normal_x);
  }
}

TEST(Normals, PreviousNormalOfFarthestCellHidesNoOthers) {
  constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
  Stages first, second;
  first.Run(support::Disc(9.7), {.spacing = 1.0});
  std::vector<CellNormal> previous = Reversed(first.next_normals);
  previous.insert(previous.begin(), {kLowest, kLowest, 1, 0});
  second.Run(support::Disc(9.7), {.spacing = 1.0}, previous);
  for (std::size_t k = 0; k < first.planes.size(); ++k) {
    if (CellOf(first, k).IsSaddle()) continue;
    EXPECT_EQ(second.planes[k].normal_x, -first.planes[k].normal_x);
  }
}

TEST(Normals, AreStoredByRowThenColumnOnePerCell) {
  support::Random random(1);
  Stages stages;
  stages.Run(support::Shifted(support::Blob(random, 10), -30, 31), {.spacing = 1.0});
  ASSERT_GT(stages.next_normals.size(), 20u);
  for (std::size_t k = 1; k < stages.next_normals.size(); ++k) {
    const CellNormal& a = stages.next_normals[k - 1];
    const CellNormal& b = stages.next_normals[k];
    EXPECT_LT(std::tie(a.row, a.column), std::tie(b.row, b.column));
  }
  std::size_t single = 0;
  for (std::size_t k = 0; k < stages.planes.size(); ++k) {
    if (CellOf(stages, k).IsSaddle()) continue;
    ++single;
    const CellNormal key = KeyOf(stages, k);
    const auto it = std::find_if(
        stages.next_normals.begin(), stages.next_normals.end(),
        [&](const CellNormal& n) { return n.row == key.row && n.column == key.column; });
    ASSERT_NE(it, stages.next_normals.end());
    EXPECT_EQ(it->x, static_cast<float>(stages.planes[k].normal_x));
    EXPECT_EQ(it->y, static_cast<float>(stages.planes[k].normal_y));
  }
  EXPECT_EQ(single, stages.next_normals.size());
}

// A circle built by hand, and one particle, which gives only the segments near it a gradient.
struct WeakCircle : Stages {
  explicit WeakCircle(std::span<const CellNormal> previous = {}) {
    support::Particles particle;
    particle.Add(24, 15.5);
    RunOn([](int x, int y) { return std::hypot(x - 15.5, y - 15.5) - 10; }, {0, 0}, {0, 0},
          particle, {.placement = Placement::kMarchingSquares, .spacing = 1.0, .clean = false},
          previous);
  }
  std::size_t Next(std::size_t k) const { return (k + 1) % planes.size(); }
  std::size_t Before(std::size_t k) const { return (k + planes.size() - 1) % planes.size(); }
};

TEST(Normals, WeakGradientUsesNeighboursElseSegment) {
  const WeakCircle circle;
  int reliable = 0, mended = 0, alone = 0;
  for (std::size_t k = 0; k < circle.planes.size(); ++k) {
    const CellPlane& plane = circle.planes[k];
    const CellPlane& before = circle.planes[circle.Before(k)];
    const CellPlane& next = circle.planes[circle.Next(k)];
    if (!plane.is_weak) {
      // The gradient of a lone particle's level set points away from it.
      EXPECT_LT(
          AngleBetween(plane.normal_x, plane.normal_y, plane.point.x - 24, plane.point.y - 15.5),
          0.1);
      ++reliable;
    } else if (before.is_weak && next.is_weak) {
      EXPECT_LT(AngleBetween(plane.normal_x, plane.normal_y, plane.OutwardX(), plane.OutwardY()),
                1e-6);
      ++alone;
    } else {
      const CellPlane& neighbour = before.is_weak ? next : before;
      EXPECT_NEAR(plane.normal_x, neighbour.normal_x, 1e-12);
      EXPECT_NEAR(plane.normal_y, neighbour.normal_y, 1e-12);
      ++mended;
    }
  }
  EXPECT_GT(reliable, 3);
  EXPECT_EQ(mended, 2);
  EXPECT_GT(alone, 20);
}

TEST(Normals, WeakGradientUsesPreviousNormalFirst) {
  const WeakCircle plain;
  std::vector<CellNormal> previous = plain.next_normals;
  for (CellNormal& normal : previous) {
    normal.x = 0.6f;
    normal.y = -0.8f;
  }
  const WeakCircle circle(previous);
  int weak = 0;
  for (const CellPlane& plane : circle.planes) {
    if (!plane.is_weak) continue;
    EXPECT_NEAR(plane.normal_x, 0.6, 1e-6);
    EXPECT_NEAR(plane.normal_y, -0.8, 1e-6);
    ++weak;
  }
  EXPECT_GT(weak, 20);
}

}  // namespace
}  // namespace partiemc
