// Cuts surfaces at planes, and checks their parts with exact arithmetic.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface_reconstructor.h"
#include "space/shells.h"
#include "space/space_particles.h"
#include "space/surface_of.h"
#include "space_cut/surface_cut.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using space::AxisPlane;
using support::Random;
using support::SpaceParticles;
using support::SurfaceOf;
using support::VolumeOf;

double AreaOf(const Surface& surface) {
  double area = 0;
  for (const ShellMeasures& measures : surface.measures) area += measures.area;
  return area;
}

// Inner points of flat faces change nothing else.
void ExpectSameWithInnerPoints(const Surface& surface, const std::vector<AxisPlane>& planes,
                               const Surface& part) {
  Surface inner = surface;
  space::SurfaceCutScratch scratch;
  space::SurfacePieces pieces;
  ASSERT_TRUE(space::CutSurface({.planes = planes, .inner_step = .7}, scratch, pieces, inner));
  const absl::Status status = Validate(inner);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(inner.ShellCount(), part.ShellCount());
  EXPECT_GE(inner.PointCount(), part.PointCount());
  EXPECT_EQ(inner.TriangleCount() - inner.cuts.size(), part.TriangleCount() - part.cuts.size());
  EXPECT_NEAR(VolumeOf(inner), VolumeOf(part), 1e-9 * (1 + std::abs(VolumeOf(part))));
  EXPECT_NEAR(AreaOf(inner), AreaOf(part), 1e-9 * (1 + AreaOf(part)));
}

// The part of a surface on the kept side of planes.
Surface Part(const Surface& surface, std::vector<AxisPlane> planes,
             space::SurfacePieces* sources = nullptr) {
  Surface part = surface;
  space::SurfaceCutScratch scratch;
  space::SurfacePieces pieces;
  EXPECT_TRUE(space::CutSurface({.planes = planes}, scratch, pieces, part));
  const absl::Status status = Validate(part);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(pieces.sources.size(), part.ShellCount());
  if (sources != nullptr) *sources = pieces;
  ExpectSameWithInnerPoints(surface, planes, part);
  return part;
}

std::array<double, 2> RangeOf(const Surface& surface, int axis) {
  double low = surface.points[axis], high = low;
  for (std::size_t k = axis; k < surface.points.size(); k += 3) {
    low = std::min(low, surface.points[k]);
    high = std::max(high, surface.points[k]);
  }
  return {low, high};
}

// All triangles of the cuts lie on the planes, which may have moved a little.
void ExpectCutsOn(const Surface& surface, const std::vector<AxisPlane>& planes) {
  for (const std::uint32_t t : surface.cuts) {
    const bool is_on = std::any_of(planes.begin(), planes.end(), [&](const AxisPlane& plane) {
      const auto at = [&](int corner) {
        return surface.points[3 * surface.triangles[3 * t + corner] + plane.axis];
      };
      return at(0) == at(1) && at(1) == at(2) &&
             std::abs(at(0) - plane.at) <= 1e-5 + 1e-9 * std::abs(plane.at);
    });
    EXPECT_TRUE(is_on) << "triangle " << t;
  }
}

// A place in the range of a surface along an axis: anywhere, or at a vertex.
double PlaceIn(const Surface& surface, int axis, Random& random) {
  if (random.Chance(.5)) return surface.points[3 * random.Below(surface.PointCount()) + axis];
  const auto [low, high] = RangeOf(surface, axis);
  return random.Uniform(low, high);
}

TEST(SurfaceCut, HalvesOfBoxAreExact) {
  Surface box;
  support::AddShell(support::BoxShell({0, 0, 0}, {3, 2, 1}), kNoShell, box);
  for (int axis = 0; axis < 3; ++axis) {
    const double size = std::array{3.0, 2.0, 1.0}[axis], face = 6 / size;
    const Surface upper = Part(box, {{axis, .25 * size, true}});
    const Surface lower = Part(box, {{axis, .25 * size, false}});
    EXPECT_DOUBLE_EQ(VolumeOf(upper), 4.5);
    EXPECT_DOUBLE_EQ(VolumeOf(lower), 1.5);
    EXPECT_NEAR(AreaOf(upper) + AreaOf(lower), 22, 1e-12);
    EXPECT_EQ(RangeOf(upper, axis)[0], .25 * size);
    EXPECT_EQ(RangeOf(lower, axis)[1], .25 * size);
    double cut = 0;
    for (const std::uint32_t t : upper.cuts) {
      const auto corner = [&](int k) { return Vec3At(upper.points, upper.triangles[3 * t + k]); };
      cut += Length(Cross(corner(1) - corner(0), corner(2) - corner(0))) / 2;
    }
    EXPECT_NEAR(cut, face, 1e-12);
  }
}

TEST(SurfaceCut, PlaneInFaceMoves) {
  Surface box;
  support::AddShell(support::BoxShell({0, 0, 0}, {3, 2, 1}), kNoShell, box);
  EXPECT_NEAR(VolumeOf(Part(box, {{0, 0, true}})), 6, 1e-7);
  EXPECT_EQ(Part(box, {{0, 3, true}}).ShellCount(), 0u);
  EXPECT_NEAR(VolumeOf(Part(box, {{2, 1, false}})), 6, 1e-7);
}

TEST(SurfaceCut, BoxInsideBodyIsTheBox) {
  Surface ball;
  support::AddShell(support::BallShell({0, 0, 0}, 10, 3), kNoShell, ball);
  std::vector<AxisPlane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    planes.push_back({axis, -1.0 - axis, true});
    planes.push_back({axis, 2, false});
  }
  const Surface part = Part(ball, planes);
  ASSERT_EQ(part.ShellCount(), 1u);
  EXPECT_EQ(part.TriangleCount(), 12u);
  EXPECT_EQ(part.cuts.size(), 12u);
  EXPECT_NEAR(part.measures[0].volume, 3 * 4 * 5, 1e-9);
  EXPECT_EQ(part.measures[0].area, 0);
}

TEST(SurfaceCut, FlatFacesHaveInnerPointsOnRequest) {
  Surface box;
  support::AddShell(support::BoxShell({0, 0, 0}, {20, 12, 8}), kNoShell, box);
  support::AddShell(support::InsideOut(support::BoxShell({6, 4, 2}, {10, 8, 6})), 0, box);
  const std::vector<AxisPlane> planes = {{2, 4.5, true}};
  space::SurfaceCutScratch scratch;
  space::SurfacePieces pieces;
  ASSERT_TRUE(space::CutSurface({.planes = planes, .inner_step = 1}, scratch, pieces, box));
  EXPECT_TRUE(Validate(box).ok()) << Validate(box);
  // Nodes of the lattice at least one step from the rim, which has the hole as its inner part.
  std::size_t found = 0;
  for (std::size_t p = 0; p < box.PointCount(); ++p) {
    const Vec3 at = Vec3At(box.points, p);
    const bool is_in_hole = at.x > 5 && at.x < 11 && at.y > 3 && at.y < 9;
    const bool is_inner = at.z == 4.5 && at.x >= 1 && at.x <= 19 && at.y >= 1 && at.y <= 11;
    if (!is_inner || is_in_hole || at.x != std::floor(at.x) || at.y != std::floor(at.y)) continue;
    EXPECT_EQ(box.normals[3 * p + 2], -1);
    ++found;
  }
  EXPECT_EQ(found, 19u * 11 - 5 * 5);
}

TEST(SurfaceCut, CavitiesOpenOrStayInTheirPiece) {
  // A dumbbell: boxes with cavities, joined by a bar.
  Surface box;
  support::AddShell(support::BoxShell({0, 0, 0}, {9, 3, 3}), kNoShell, box);
  support::AddShell(support::InsideOut(support::BoxShell({1, 1, 1}, {2, 2, 2})), 0, box);
  support::AddShell(support::InsideOut(support::BoxShell({4, 1, 1}, {5, 2, 2})), 0, box);
  support::AddShell(support::BallShell({4.5, 1.5, 1.5}, .3, 1), kNoShell, box);
  space::SurfacePieces pieces;
  const Surface opened = Part(box, {{0, 4.1, true}}, &pieces);
  ASSERT_EQ(opened.ShellCount(), 2u);  // The open cavity is a part of the outer shell.
  EXPECT_EQ(pieces.sources, (std::vector<std::uint32_t>{0, 3}));
  EXPECT_EQ(opened.outer_of, (std::vector<std::uint32_t>{kNoShell, kNoShell}));
  const Surface whole = Part(box, {{0, 3, true}});
  ASSERT_EQ(whole.ShellCount(), 3u);
  EXPECT_EQ(whole.outer_of, (std::vector<std::uint32_t>{kNoShell, 0, kNoShell}));
  EXPECT_NEAR(opened.measures[0].volume, 4.9 * 9 - .9, 1e-9);
}

TEST(SurfaceCut, CavityStaysInOneOfSeveralPieces) {
  // A U whose legs have a cavity each falls apart without its bottom.
  SpaceParticles u;
  Random random(1);
  u.Add(support::Box({0, 0, 0}, {40, 12, 8}, 0, random));
  u.Add(support::Box({0, 0, 8}, {14, 12, 40}, 0, random));
  u.Add(support::Box({26, 0, 8}, {40, 12, 40}, 0, random));
  SpaceParticles hollow;
  for (std::size_t k = 0; k < u.size(); ++k) {
    const Vec3 at = u.At(k);
    const bool is_hole = Length(at - Vec3{7, 6, 28}) < 3.5 || Length(at - Vec3{33, 6, 28}) < 3.5;
    if (!is_hole) hollow.Add(at);
  }
  const Surface surface = SurfaceOf(hollow, {.placement = SurfacePlacement::kMarchingCubes});
  ASSERT_EQ(surface.ShellCount(), 3u);
  const Surface legs = Part(surface, {{2, 15, true}});
  EXPECT_EQ(legs.ShellCount(), 4u);
  EXPECT_EQ(Part(surface, {{2, 28, true}}).ShellCount(), 2u);
}

TEST(SurfaceCut, LargestPieceHasTheIdentity) {
  Surface box;
  support::AddShell(support::BoxShell({0, 0, 0}, {3, 2, 1}), kNoShell, box);
  box.measures[0].particles = 6;
  box.measures[0].identity = 9;
  box.parents = {4, 5};
  box.parent_offsets = {0, 2};
  const Surface part = Part(box, {{0, 2, true}});
  EXPECT_EQ(part.measures[0].identity, 9u);
  EXPECT_EQ(part.measures[0].particles, 6u);
  EXPECT_EQ(part.ParentsOf(0).size(), 2u);
}

TEST(SurfaceCut, ShellsThatAreNotCutKeepTheirBits) {
  Surface both;
  support::AddShell(support::BallShell({0, 0, 0}, 3, 2), kNoShell, both);
  support::AddShell(support::BallShell({10, 0, 0}, 3, 2), kNoShell, both);
  const std::vector<AxisPlane> planes = {{2, .1, true}};
  const std::vector<std::uint8_t> is_cut = {1, 0};
  Surface part = both;
  space::SurfaceCutScratch scratch;
  space::SurfacePieces pieces;
  ASSERT_TRUE(space::CutSurface({.planes = planes, .is_cut = is_cut}, scratch, pieces, part));
  EXPECT_TRUE(Validate(part).ok()) << Validate(part);
  ASSERT_EQ(part.ShellCount(), 2u);
  EXPECT_EQ(part.measures[1], both.measures[1]);
  EXPECT_EQ(part.point_offsets[2] - part.point_offsets[1],
            both.point_offsets[2] - both.point_offsets[1]);
  EXPECT_LT(part.measures[0].volume, .5 * both.measures[0].volume);
}

TEST(SurfaceCut, FlatLayerIsCutAtFourFaces) {
  // The faces pass through lattice nodes, and the top is flat up to rounding.
  for (const double shift : {0.0, 1e5}) {
    SpaceParticles layer;
    Random random(1);
    layer.Add(support::Box(Vec3{shift, 0, 0}, Vec3{shift + 24, 24, 4}, 0, random));
    for (const auto placement : {SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                 SurfacePlacement::kVirtualPlane}) {
      const Surface surface = SurfaceOf(layer, {.placement = placement});
      const std::vector<AxisPlane> planes = {
          {0, shift + 7, true}, {0, shift + 16, false}, {1, 7, true}, {1, 16, false}};
      const Surface part = Part(surface, planes);
      ASSERT_EQ(part.ShellCount(), 1u);
      ExpectCutsOn(part, planes);
      EXPECT_NEAR(part.measures[0].area, 2 * 81, 1e-2);
      // The nine parts between and beside the planes are the whole.
      double sum = 0;
      for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
          std::vector<AxisPlane> sides;
          if (column > 0) sides.push_back({0, column == 1 ? shift + 7 : shift + 16, true});
          if (column < 2) sides.push_back({0, column == 0 ? shift + 7 : shift + 16, false});
          if (row > 0) sides.push_back({1, row == 1 ? 7. : 16., true});
          if (row < 2) sides.push_back({1, row == 0 ? 7. : 16., false});
          sum += VolumeOf(Part(surface, sides));
        }
      }
      EXPECT_NEAR(sum, VolumeOf(surface), 1e-5 * sum);
    }
  }
}

TEST(SurfaceCut, PartsOfRandomSurfacesMakeTheWhole) {
  for (std::uint64_t seed = 1; seed <= support::Tries(60u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto placement = std::array{SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                      SurfacePlacement::kVirtualPlane}[random.Below(3)];
    const Surface surface = SurfaceOf(support::RandomSpaceScene(seed), {.placement = placement});
    if (surface.ShellCount() == 0) continue;
    const int axis = static_cast<int>(random.Below(3));
    const double at = PlaceIn(surface, axis, random);
    const Surface upper = Part(surface, {{axis, at, true}});
    const Surface lower = Part(surface, {{axis, at, false}});
    std::vector<double> xs;
    for (std::size_t k = axis; k < surface.points.size(); k += 3) xs.push_back(surface.points[k]);
    const double volume = VolumeOf(surface), area = AreaOf(surface);
    // Near a vertex, the planes of the halves may move by different steps.
    const bool is_free =
        std::none_of(xs.begin(), xs.end(), [&](double x) { return std::abs(x - at) < 1e-7; });
    const double tolerance = is_free ? 1e-9 : 1e-4;
    EXPECT_NEAR(VolumeOf(upper) + VolumeOf(lower), volume, tolerance * (std::abs(volume) + area));
    EXPECT_NEAR(AreaOf(upper) + AreaOf(lower), area, tolerance * area);
    ExpectCutsOn(upper, {{axis, at, true}});
    // Other planes cut the caps.
    double sum = 0;
    const int second = (axis + 1) % 3;
    const double across = PlaceIn(surface, second, random);
    for (const bool above : {true, false}) {
      for (const bool beyond : {true, false}) {
        const std::vector<AxisPlane> planes = {{axis, at, above}, {second, across, beyond}};
        const Surface quarter = Part(surface, planes);
        ExpectCutsOn(quarter, planes);
        sum += VolumeOf(quarter);
      }
    }
    // The planes of the quarters may have moved by different steps.
    EXPECT_NEAR(sum, volume, 1e-4 * (std::abs(volume) + area));
    std::vector<AxisPlane> planes;
    for (int k = 0; k < 3; ++k) {
      double low = PlaceIn(surface, k, random), high = PlaceIn(surface, k, random);
      if (std::abs(low - high) < .01) continue;
      planes.push_back({k, std::min(low, high), true});
      planes.push_back({k, std::max(low, high), false});
    }
    Part(surface, planes);
  }
}

}  // namespace
}  // namespace partiemc
