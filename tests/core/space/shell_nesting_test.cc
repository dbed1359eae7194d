// ShellsAround: the nesting of shells, compared with what is known of boxes and balls.
#include "check/shell_nesting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/cancellation.h"
#include "base/vec3.h"
#include "check/work_limit.h"
#include "partiemc/surface.h"
#include "space/shells.h"
#include "space_cut/surface_cut.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::BallShell;
using support::BoxShell;
using support::InsideOut;
using support::Random;
using support::Shell;

/// Appends a shell without normals and measures, which nesting does not need.
void Append(const Shell& shell, Surface& surface) {
  const auto first = static_cast<std::uint32_t>(surface.PointCount());
  for (const Vec3& point : shell.points) {
    surface.points.insert(surface.points.end(), {point.x, point.y, point.z});
  }
  for (const std::uint32_t point : shell.triangles) surface.triangles.push_back(first + point);
  surface.point_offsets.push_back(static_cast<std::uint32_t>(surface.PointCount()));
  surface.triangle_offsets.push_back(static_cast<std::uint32_t>(surface.TriangleCount()));
  surface.outer_of.push_back(kNoShell);
}

struct Solid {
  Vec3 low, high;
};

double ExtentOf(const Solid& solid) {
  return (solid.high.x - solid.low.x) + (solid.high.y - solid.low.y) + (solid.high.z - solid.low.z);
}

bool IsInside(const Solid& inner, const Solid& outer) {
  return outer.low.x < inner.low.x && inner.high.x < outer.high.x && outer.low.y < inner.low.y &&
         inner.high.y < outer.high.y && outer.low.z < inner.low.z && inner.high.z < outer.high.z;
}

/// Adds disjoint boxes in `space`, in slabs across a random axis, and boxes in these boxes. All
/// coordinates are integers, so lines through points run through edges and points of other boxes.
void AddBoxes(const Solid& space, int depth, Random& random, std::vector<Solid>& boxes) {
  constexpr double Vec3::*kAxes[] = {&Vec3::x, &Vec3::y, &Vec3::z};
  const auto axis = kAxes[random.Below(3)];
  double from = space.low.*axis;
  while (boxes.size() < 200) {
    const double to = from + 3 + static_cast<double>(random.Below(random.Chance(.3) ? 60 : 6));
    if (to > space.high.*axis) return;
    Solid slab = space;
    slab.low.*axis = from;
    slab.high.*axis = to;
    from = to;
    const Solid box{slab.low + Vec3{1, 1, 1}, slab.high - Vec3{1, 1, 1}};
    if (box.low.x >= box.high.x || box.low.y >= box.high.y || box.low.z >= box.high.z) continue;
    boxes.push_back(box);
    if (depth > 0) AddBoxes(box, depth - 1, random, boxes);
  }
}

/// By solid: the smallest other one around it.
std::vector<std::uint32_t> NestingOf(const std::vector<Solid>& solids) {
  std::vector<std::uint32_t> around(solids.size(), kNoShell);
  for (std::size_t k = 0; k < solids.size(); ++k) {
    for (std::uint32_t other = 0; other < solids.size(); ++other) {
      if (!IsInside(solids[k], solids[other])) continue;
      std::uint32_t& best = around[k];
      if (best == kNoShell || ExtentOf(solids[other]) < ExtentOf(solids[best])) best = other;
    }
  }
  return around;
}

TEST(ShellsAround, AgreesWithBoxesOnRandomNesting) {
  Random random(11);
  std::size_t nested = 0;
  for (int trial = 0; trial < support::Tries(200); ++trial) {
    std::vector<Solid> boxes;
    AddBoxes({{-40, -40, -40}, {40, 40, 40}}, 5, random, boxes);
    for (std::size_t k = boxes.size(); k > 1; --k) std::swap(boxes[k - 1], boxes[random.Below(k)]);
    Surface surface;
    for (const Solid& box : boxes) {
      const Shell shell = BoxShell(box.low, box.high);
      Append(random.Chance(.5) ? InsideOut(shell) : shell, surface);
    }
    const std::vector<std::uint32_t> expected = NestingOf(boxes);
    ASSERT_EQ(ShellsAround(surface), expected) << "trial " << trial;
    nested += expected.size() - std::count(expected.begin(), expected.end(), kNoShell);
  }
  EXPECT_GT(nested, 1'000u);
}

// A ball in the corner of the bounding box of another one is not in it.
TEST(ShellsAround, AgreesWithBallsInBoundingBoxes) {
  Random random(12);
  Surface surface;
  constexpr std::uint32_t kLarge = 3;
  for (std::uint32_t k = 0; k < kLarge; ++k) Append(BallShell({0, 0, 25.0 * k}, 10, 2), surface);
  std::vector<std::uint32_t> expected(kLarge, kNoShell);
  for (int k = 0; k < 300; ++k) {
    const std::uint32_t large = static_cast<std::uint32_t>(random.Below(kLarge));
    const Vec3 by{random.Uniform(-10, 10), random.Uniform(-10, 10), random.Uniform(-10, 10)};
    const double distance = Length(by);
    if (distance > 9.2 && distance < 10.2) continue;  // It may touch the large ball.
    Append(BallShell(by + Vec3{0, 0, 25.0 * large}, .01, 0), surface);
    expected.push_back(distance < 10 ? large : kNoShell);
  }
  EXPECT_EQ(ShellsAround(surface), expected);
  EXPECT_GT(std::count(expected.begin() + kLarge, expected.end(), kNoShell), 50);
}

/// Boxes with a cavity each, in a row along an axis.
Surface StackAlong(double Vec3::*axis, std::uint32_t count) {
  Surface surface;
  for (std::uint32_t k = 0; k < count; ++k) {
    Vec3 low{0, 0, 0};
    low.*axis = 5.0 * k;
    Append(BoxShell(low, low + Vec3{4, 4, 4}), surface);
    Append(InsideOut(BoxShell(low + Vec3{1, 1, 1}, low + Vec3{3, 3, 3})), surface);
  }
  return surface;
}

// Testing the triangles of all shells of the stack would exceed the limit many times.
TEST(ShellsAround, WorkOfStackIsNotQuadratic) {
  constexpr std::uint32_t kCount = 1'000;
  constexpr std::uint64_t kWorkOfBox = 4'000;
  for (const auto axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
    const Surface surface = StackAlong(axis, kCount);
    WorkLimit limit(kWorkOfBox * kCount);
    std::vector<std::uint32_t> around;
    ASSERT_NO_THROW(around = ShellsAround(surface, &limit));
    for (std::uint32_t k = 0; k < kCount; ++k) {
      ASSERT_EQ(around[2 * k], kNoShell);
      ASSERT_EQ(around[2 * k + 1], 2 * k);
    }
  }
}

TEST(ShellsAround, TakesWorkFromLimit) {
  const Surface surface = StackAlong(&Vec3::z, 1'000);
  WorkLimit limit(100'000);
  EXPECT_THROW((void)ShellsAround(surface, &limit), TooMuchWork);
}

TEST(ShellsAround, StopsWhenCancelledWithoutLimit) {
  const Surface surface = StackAlong(&Vec3::z, 2);
  const std::atomic<bool> flag = true;
  const CancellationScope scope(&flag);
  EXPECT_THROW((void)ShellsAround(surface), Cancelled);
  EXPECT_THROW((void)OrientationsOf(surface), Cancelled);
}

TEST(CutSurface, StopsWhenCancelledWithoutPlanes) {
  const std::atomic<bool> flag = true;
  const CancellationScope scope(&flag);
  Surface surface = StackAlong(&Vec3::z, 2);
  const Surface given = surface;
  space::SurfaceCutScratch scratch;
  space::SurfacePieces pieces;
  EXPECT_THROW((void)space::CutSurface({.planes = {}}, scratch, pieces, surface), Cancelled);
  EXPECT_EQ(surface, given);
}

}  // namespace
}  // namespace partiemc
