// Bodies that reach their own image in a periodic box: surfaces are cut at its faces.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "space/periodic_bodies.h"
#include "space/surface_of.h"
#include "space/surface_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::BoxOf;
using support::Filled;
using support::Random;
using support::SpaceParticles;
using support::Sums;
using support::SumsOf;
using support::SurfaceOf;
using support::SurfaceStream;
using support::Uniform;
using support::Wrapped;

double Coordinate(const Surface& surface, std::size_t point, std::size_t axis) {
  return surface.points[3 * point + axis];
}

Surface InBox(const SpaceParticles& particles, const PeriodicBox& box) {
  return SurfaceOf(particles, {.placement = SurfacePlacement::kVirtualPlane, .box = box});
}

using FacePoint = std::array<double, 2>;
using FaceSegment = std::array<FacePoint, 2>;

/// The outline at which a face cuts the free surface: edges on the face of triangles that are no
/// cut.
std::vector<FaceSegment> OutlineOnFace(const Surface& surface, std::size_t axis, double face) {
  std::vector<FaceSegment> outline;
  for (std::uint32_t t = 0; t < surface.TriangleCount(); ++t) {
    if (std::ranges::binary_search(surface.cuts, t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      FaceSegment segment;
      bool is_on_face = true;
      for (std::size_t end = 0; end < 2; ++end) {
        const std::uint32_t p = surface.triangles[3 * std::size_t{t} + (k + end) % 3];
        is_on_face = is_on_face && std::abs(Coordinate(surface, p, axis) - face) <= 1e-4;
        segment[end] = {Coordinate(surface, p, (axis + 1) % 3),
                        Coordinate(surface, p, (axis + 2) % 3)};
      }
      if (is_on_face) outline.push_back(segment);
    }
  }
  return outline;
}

double DistanceFrom(const FacePoint& p, const FaceSegment& segment) {
  const auto& [a, b] = segment;
  const double x = b[0] - a[0], y = b[1] - a[1], square = x * x + y * y;
  const double along = square > 0 ? ((p[0] - a[0]) * x + (p[1] - a[1]) * y) / square : 0;
  const double t = std::clamp(along, 0., 1.);
  return std::hypot(a[0] + t * x - p[0], a[1] + t * y - p[1]);
}

/// The largest distance of a point of the outline on one face from the outline on the opposite
/// face.
double Mismatch(const Surface& surface, const PeriodicBox& box, std::size_t axis) {
  const double origin = box.axes[axis]->origin, length = box.axes[axis]->length;
  const std::array<std::vector<FaceSegment>, 2> faces = {
      OutlineOnFace(surface, axis, origin), OutlineOnFace(surface, axis, origin + length)};
  double worst = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    for (const FaceSegment& of : faces[side]) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const FaceSegment& segment : faces[1 - side]) {
        nearest = std::min(nearest, DistanceFrom(of[0], segment));
      }
      worst = std::max(worst, nearest);
    }
  }
  return worst;
}

double CutArea(const Surface& surface) {
  double area = 0;
  for (const std::uint32_t cut : surface.cuts) {
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = Vec3At(surface.points, surface.triangles[3 * std::size_t{cut} + k]);
    }
    area += Length(Cross(corners[1] - corners[0], corners[2] - corners[0])) / 2;
  }
  return area;
}

void ExpectCloselyInBox(const Surface& surface, const PeriodicBox& box) {
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!box.axes[axis]) continue;
      const double above = Coordinate(surface, p, axis) - box.axes[axis]->origin;
      ASSERT_GE(above, -1e-4);
      ASSERT_LE(above, box.axes[axis]->length + 1e-4);
    }
  }
}

TEST(SurfacePercolation, FlatLayerIsCutAtFourFaces) {
  Random random(1);
  const PeriodicBox box = BoxOf(30, 24, 60);
  const SpaceParticles layer =
      Filled(30, 24, 30, 0, random, [](const Vec3& at) { return at.z > 20; });
  for (const auto placement : {SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                               SurfacePlacement::kVirtualPlane}) {
    const Surface surface = SurfaceOf(layer, {.placement = placement, .box = box});
    ASSERT_EQ(surface.ShellCount(), 1u);
    ExpectCloselyInBox(surface, box);
    const Sums sums = SumsOf(surface);
    const bool is_exact = placement == SurfacePlacement::kVirtualPlane;
    EXPECT_NEAR(sums.volume, 7200, is_exact ? 1e-3 : 150);
    EXPECT_NEAR(sums.area, 2 * 30 * 24, is_exact ? 1e-3 : 15);
    EXPECT_NEAR(CutArea(surface), 2 * (30 + 24) * sums.volume / (30 * 24), is_exact ? 1e-2 : 5);
    EXPECT_EQ(sums.particles, layer.size());
    EXPECT_LT(Mismatch(surface, box, 0), 1e-7);
    EXPECT_LT(Mismatch(surface, box, 1), 1e-7);
  }
}

SpaceParticles Wave(int x, int y, double phase, double shake, Random& random) {
  return Filled(x, y, 24, shake, random, [&](const Vec3& at) {
    return at.z < 12 + 4 * std::sin(2 * M_PI * (at.x + phase) / x);
  });
}

// Where the faces lie does not matter.
TEST(SurfacePercolation, WavyLayerKeepsItsVolumeAndArea) {
  Random random(1);
  const SpaceParticles wave = Wave(40, 24, 7, .2, random);
  std::optional<Sums> first;
  for (const Vec3& origin : {Vec3{0, 0, 0}, Vec3{13, 0, 0}, Vec3{0, 5.3, 0}, Vec3{-7.7, 40.2, 0}}) {
    const PeriodicBox box = BoxOf(40, 24, 0, origin);
    const Surface surface = InBox(Wrapped(wave, box), box);
    ASSERT_EQ(surface.ShellCount(), 1u);
    ExpectCloselyInBox(surface, box);
    const Sums sums = SumsOf(surface);
    if (!first) first = sums;
    EXPECT_NEAR(sums.volume / static_cast<double>(wave.size()), 1, .001);
    EXPECT_NEAR(sums.volume / first->volume, 1, 1e-4);
    EXPECT_NEAR(sums.area / first->area, 1, 1e-3);
    EXPECT_EQ(sums.particles, wave.size());
    const double along_x = Mismatch(surface, box, 0), along_y = Mismatch(surface, box, 1);
    std::printf("wave: volume %.6f, area %.4f, faces differ by %.1e and %.1e h\n",
                sums.volume / static_cast<double>(wave.size()), sums.area, along_x, along_y);
    EXPECT_LT(along_x, 1e-3);
    EXPECT_LT(along_y, 1e-3);
  }
}

// The lattice does not divide the lengths of the box.
TEST(SurfacePercolation, AnyLengthWillDo) {
  Random random(2);
  SpaceParticles wave = Wave(40, 24, 7, .1, random);
  const PeriodicBox box = BoxOf(40 * 1.0171, 24 * .9913, 0);
  for (std::size_t k = 0; k < wave.xyz.size(); k += 3) {
    wave.xyz[k] *= 1.0171;
    wave.xyz[k + 1] *= .9913;
  }
  const Surface surface = InBox(wave, box);
  ASSERT_EQ(surface.ShellCount(), 1u);
  EXPECT_NEAR(SumsOf(surface).volume / static_cast<double>(wave.size()), 1, .001);
  const double along_x = Mismatch(surface, box, 0), along_y = Mismatch(surface, box, 1);
  std::printf("faces differ by %.4f and %.4f h\n", along_x, along_y);
  EXPECT_LT(along_x, 1);
  EXPECT_LT(along_y, 1);
}

// A cavity in the box is a cavity; across faces it is open.
TEST(SurfacePercolation, FullBoxHasTheAreaOfItsCavity) {
  Random random(1);
  const PeriodicBox box = BoxOf(30, 30, 30);
  for (const Vec3& centre : {Vec3{15, 15, 15}, Vec3{0, 15, 15}, Vec3{0, 30, 15}, Vec3{0, 0, 0}}) {
    const SpaceParticles all = Filled(30, 30, 30, .1, random, [&](const Vec3& at) {
      const Vec3 from = at - centre;
      return Length({std::remainder(from.x, 30), std::remainder(from.y, 30),
                     std::remainder(from.z, 30)}) > 7;
    });
    const Surface surface = InBox(all, box);
    EXPECT_EQ(surface.ShellCount(), centre.x == 15 ? 2u : 1u);
    ExpectCloselyInBox(surface, box);
    const Sums sums = SumsOf(surface);
    std::printf("cavity: volume %.6f, area %.4f of the sphere's\n",
                sums.volume / static_cast<double>(all.size()), sums.area / (4 * M_PI * 49));
    EXPECT_NEAR(sums.volume / static_cast<double>(all.size()), 1, .001);
    EXPECT_NEAR(sums.area / (4 * M_PI * 49), 1, .03);
    EXPECT_EQ(sums.particles, all.size());
  }
  const Surface full = InBox(Filled(30, 30, 30, 0, random, [](const Vec3&) { return true; }), box);
  ASSERT_EQ(full.ShellCount(), 1u);
  EXPECT_EQ(full.cuts.size(), full.TriangleCount());
  EXPECT_EQ(full.measures[0].area, 0);
  EXPECT_NEAR(full.measures[0].volume, 27000, 1e-2);
}

TEST(SurfacePercolation, ColumnsEndAtTheFacesOfTheirAxis) {
  Random random(3);
  const PeriodicBox box = BoxOf(40, 40, 40);
  const auto disc = [](double a, double b) { return std::hypot(a - 20, b - 10) < 5; };
  const SpaceParticles along_z =
      Filled(40, 40, 40, .1, random, [&](const Vec3& at) { return disc(at.x, at.y); });
  const Surface one = InBox(along_z, box);
  ASSERT_EQ(one.ShellCount(), 1u);
  EXPECT_NEAR(one.measures[0].volume / static_cast<double>(along_z.size()), 1, .001);
  EXPECT_NEAR(one.measures[0].area / (2 * M_PI * 5 * 40), 1, .03);
  EXPECT_LT(Mismatch(one, box, 2), 1e-3);
  // Two columns along different axes are two clusters. Both are cut at all four faces.
  SpaceParticles both =
      Filled(40, 40, 40, 0, random, [&](const Vec3& at) { return disc(at.x + 20, at.z); });
  const std::size_t along_y = both.size();
  both.Add(
      Filled(40, 40, 40, 0, random, [&](const Vec3& at) { return disc(at.y + 20, at.z - 20); }));
  const Surface two = InBox(both, box);
  EXPECT_EQ(two.ShellCount(), 4u);  // Halves: both columns lie on a face.
  std::vector<std::uint64_t> particles;
  for (const ShellMeasures& measures : two.measures) particles.push_back(measures.particles);
  std::ranges::sort(particles, std::greater());
  EXPECT_EQ(particles, (std::vector<std::uint64_t>{along_y, along_y, 0, 0}));
  EXPECT_NEAR(SumsOf(two).volume / static_cast<double>(both.size()), 1, .005);
}

TEST(SurfacePercolation, DiagonalLayerPercolatesAlongAllAxes) {
  Random random(4);
  const PeriodicBox box = BoxOf(30, 30, 30);
  const auto layer = Filled(30, 30, 30, .1, random, [](const Vec3& at) {
    return std::abs(std::remainder(at.x + at.y - 22, 30)) < 6;
  });
  const Surface surface = InBox(layer, box);
  EXPECT_EQ(surface.ShellCount(), 2u);
  ExpectCloselyInBox(surface, box);
  const Sums sums = SumsOf(surface);
  EXPECT_NEAR(sums.volume / static_cast<double>(layer.size()), 1, .001);
  EXPECT_NEAR(sums.area / (2 * 30 * 30 * std::sqrt(2.)), 1, .03);
  EXPECT_EQ(sums.particles, layer.size());
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_LT(Mismatch(surface, box, axis), 1e-3);
}

// Drops near a layer, in one cluster with it, are whole wherever they are.
TEST(SurfacePercolation, DropsNearALayerStayWhole) {
  Random random(5);
  const PeriodicBox box = BoxOf(30, 36, 0);
  std::optional<double> volume;
  for (const Vec3& centre : {Vec3{15, 18, 15.5}, {0, 18, 15.5}, {14, 1, 15.5}, {29, 35.5, 15.5}}) {
    SpaceParticles all = Filled(30, 36, 8, 0, random, [](const Vec3&) { return true; });
    const std::size_t layer = all.size();
    Random of_drop(6);
    SpaceParticles drop = support::Ball({0, 0, 0}, 4, .1, of_drop);
    for (std::size_t k = 0; k < drop.size(); ++k) all.Add(drop.At(k) + centre);
    const Surface surface = InBox(Wrapped(all, box), box);
    ASSERT_EQ(surface.ShellCount(), 2u);
    const std::size_t of = surface.measures[0].particles == layer ? 1 : 0;
    EXPECT_EQ(surface.measures[1 - of].particles, layer);
    EXPECT_NEAR(surface.measures[1 - of].volume, 8 * 30 * 36, 1);
    const ShellMeasures& whole = surface.measures[of];
    EXPECT_EQ(whole.particles, drop.size());
    if (!volume) volume = whole.volume;
    EXPECT_NEAR(whole.volume, *volume, .002 * *volume);
    EXPECT_NEAR(whole.volume, static_cast<double>(drop.size()), .005 * *volume);
    // The image with the most particles in the box; on the face, any.
    EXPECT_NEAR(std::remainder(whole.centroid_x - centre.x, 30), 0, .1);
    EXPECT_NEAR(std::remainder(whole.centroid_y - centre.y, 36), 0, .1);
    for (const std::uint32_t cut : surface.cuts) {
      EXPECT_GE(cut, surface.triangle_offsets[1 - of]);
      EXPECT_LT(cut, surface.triangle_offsets[2 - of]);
    }
  }
}

// The sizes of the bodies that are not cut, for two places of the faces.
std::pair<std::vector<std::uint64_t>, std::vector<std::uint64_t>> WholeBodies(std::uint64_t seed) {
  Random random(seed);
  const int x = 8 + static_cast<int>(random.Uniform(0, 10)), y = x + 3,
            thick = 2 + static_cast<int>(seed % 3);
  SpaceParticles all = Filled(x, y, thick, .1, random, [](const Vec3&) { return true; });
  for (int drop = 0; drop < 5; ++drop) {
    const Vec3 from{random.Uniform(0, x), random.Uniform(0, y), thick + random.Uniform(1, 8)};
    const Vec3 along = seed % 2 == 0 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    for (int k = 0; k < 6; ++k) all.Add(from + k * along);
  }
  std::array<std::vector<std::uint64_t>, 2> sizes;
  for (std::size_t place = 0; place < 2; ++place) {
    const PeriodicBox box = BoxOf(x, y, 0, {place == 0 ? 0. : x / 2, place == 0 ? 0. : 4., 0});
    const Surface surface = SurfaceOf(Wrapped(all, box), {.kernel_radius = 2, .box = box});
    for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
      const std::uint32_t begin = surface.triangle_offsets[shell];
      const auto cut = std::ranges::lower_bound(surface.cuts, begin);
      const bool is_cut = cut != surface.cuts.end() && *cut < surface.triangle_offsets[shell + 1];
      if (!is_cut) sizes[place].push_back(surface.measures[shell].particles);
    }
    std::ranges::sort(sizes[place]);
  }
  return {sizes[0], sizes[1]};
}

// The level set is wrong near the ends of the copies. Drops must not become part of the layer
// there.
TEST(SurfacePercolation, BodiesAreWholeWhereverTheFacesAre) {
  for (std::uint64_t seed = 1; seed <= support::Tries(60u); ++seed) {
    const auto [here, there] = WholeBodies(seed);
    EXPECT_EQ(here, there) << "seed " << seed;
  }
}

// A ball in a cavity across the corner, and lone particles on faces.
TEST(SurfacePercolation, DropsAcrossTheCornerStayWhole) {
  Random random(7);
  const PeriodicBox box = BoxOf(36, 36, 36);
  SpaceParticles all = Filled(36, 36, 36, 0, random, [&](const Vec3& at) {
    return Length({std::remainder(at.x, 36), std::remainder(at.y, 36), std::remainder(at.z, 36)}) >
           11;
  });
  const std::size_t fluid = all.size();
  const SpaceParticles ball = support::Ball({0, 0, 0}, 4, .1, random);
  all.Add(ball);
  all.Add(Vec3{0, 0, 7.5});
  all.Add(Vec3{36, 7.5, 36});
  const Surface surface = InBox(Wrapped(all, box), box);
  ASSERT_EQ(surface.ShellCount(), 4u);
  std::vector<std::uint64_t> particles;
  for (const ShellMeasures& measures : surface.measures) particles.push_back(measures.particles);
  std::ranges::sort(particles);
  EXPECT_EQ(particles, (std::vector<std::uint64_t>{1, 1, ball.size(), fluid}));
  EXPECT_NEAR(SumsOf(surface).volume / static_cast<double>(all.size()), 1, .001);
}

// A bar across both faces counts with all its particles, once.
TEST(SurfacePercolation, MinimumSizeCountsAllImages) {
  Random random(8);
  const PeriodicBox box = BoxOf(24, 24, 0);
  SpaceParticles all = Filled(24, 24, 6, 0, random, [](const Vec3&) { return true; });
  const std::size_t layer = all.size();
  const SpaceParticles drop = support::Box({-2, -2, 12}, {1, 1, 14}, 0, random);
  all.Add(drop);
  SurfaceParameters parameters{.placement = SurfacePlacement::kVirtualPlane, .box = box};
  for (const std::size_t least : {drop.size(), drop.size() + 1, layer, layer + 1}) {
    parameters.min_component_particles = least;
    const Surface surface = SurfaceOf(Wrapped(all, box), parameters);
    const std::size_t shells = least <= drop.size() ? 2 : least <= layer ? 1 : 0;
    EXPECT_EQ(surface.ShellCount(), shells);
    EXPECT_EQ(surface.statistics.dropped_spray, 2 - shells);
  }
}

// An ellipsoid would have no end at the faces.
TEST(SurfacePercolation, ShortColumnsAreNoDrops) {
  Random random(12);
  const PeriodicBox box = BoxOf(0, 0, 8);
  const SpaceParticles column = support::Box({0, 0, 0}, {1, 0, 7}, 0, random);
  const Surface surface = SurfaceOf(
      column, {.placement = SurfacePlacement::kVirtualPlane, .kernel_radius = 2, .box = box});
  ASSERT_EQ(surface.ShellCount(), 1u);
  EXPECT_FALSE(surface.cuts.empty());
  ExpectCloselyInBox(surface, box);
  EXPECT_EQ(surface.measures[0].particles, column.size());
  EXPECT_NEAR(surface.measures[0].volume, 16, .1);
}

// Drops of up to six particles near a layer, some across faces. A node of the lattice may be in a
// drop but not in its image, because no cell fits into the box.
TEST(SurfacePercolation, EveryParticleCountsOnce) {
  constexpr double kApart = 5.4, kLength = 4 * kApart;
  const PeriodicBox box = BoxOf(kLength, kLength, 0);
  for (std::uint64_t seed = 1; seed <= support::Tries(20u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    SpaceParticles all = Filled(21, 21, 4, .05, random, [](const Vec3&) { return true; });
    for (std::size_t k = 0; k < all.xyz.size(); ++k) {
      if (k % 3 < 2) all.xyz[k] *= kLength / 21;
    }
    const double x = random.Uniform(0, kApart), y = random.Uniform(0, kApart);
    for (int site = 0; site < 48; ++site) {
      const Vec3 at{x + kApart * (site % 4), y + kApart * (site / 4 % 4), 8 + kApart * (site / 16)};
      for (std::size_t count = random.Below(6) + 1; count > 0; --count) {
        const double dx = random.Uniform(-.6, .6), dy = random.Uniform(-.6, .6);
        all.Add(at + Vec3{dx, dy, random.Uniform(-.6, .6)});
      }
    }
    const Surface surface =
        SurfaceOf(Wrapped(all, box), {.placement = SurfacePlacement::kVirtualPlane,
                                      .cell_size = seed % 2 == 0 ? 1 : .5,
                                      .box = box});
    EXPECT_EQ(surface.ShellCount(), 49u);
    const Sums sums = SumsOf(surface);
    EXPECT_EQ(sums.particles, all.size());
    EXPECT_NEAR(sums.volume / static_cast<double>(all.size()), 1, .005);
  }
}

TEST(SurfacePercolation, BitsDependNeitherOnThreadsNorOnOrder) {
  Random random(10);
  const PeriodicBox box = BoxOf(30.7, 24.3, 0);
  SpaceParticles all = Wave(30, 24, 3, .3, random);
  all.Add(support::Ball({0, 0, 21}, 3, .2, random));
  all.Add(Uniform(40, {30, 24, 40}, random));
  all = Wrapped(all, box);
  const SurfaceParameters parameters{.placement = SurfacePlacement::kVirtualPlane, .box = box};
  const Surface first = SurfaceOf(all, parameters);
  ASSERT_FALSE(first.cuts.empty());
  EXPECT_EQ(SurfaceOf(support::Shuffled(all, random), parameters), first);
  for (const unsigned threads : {1u, 2u, 7u}) {
    const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, threads);
    Arena arena(threads);
    arena.Execute([&] { EXPECT_EQ(SurfaceOf(all, parameters), first); });
  }
}

// A drop at a face, almost in contact with a rough layer, is whole at this face only. The layer
// must not differ from its image at the opposite face. In the first of these frames, a cell has a
// loop of the drop and a loop of the layer.
TEST(SurfacePercolation, DropAtOneFaceKeepsOppositeFacesEqual) {
  const PeriodicBox box = BoxOf(14, 12, 0);
  for (std::uint64_t seed = 29; seed < 33; ++seed) {
    Random random(seed);
    SpaceParticles all = Filled(14, 12, 5, .3, random,
                                [&](const Vec3& at) { return random.Chance(at.z > 4 ? .7 : 1); });
    const double gap = random.Uniform(1, 2);
    all.Add(support::Ball({7, .5, 7.3 + gap}, 2.3, .3, random));
    const Surface surface = InBox(Wrapped(all, box), box);
    EXPECT_LT(Mismatch(surface, box, 0), 1e-4);
    EXPECT_LT(Mismatch(surface, box, 1), 1e-4) << "seed " << seed;
  }
}

// At a face, half of the particles around a point are copies.
TEST(SurfacePercolation, AttributesContinueAcrossTheFaces) {
  Random random(11);
  const PeriodicBox box = BoxOf(30, 24, 0);
  const SpaceParticles wave = Wave(30, 24, 3, .1, random);
  std::vector<float> values;
  for (std::size_t k = 0; k < wave.size(); ++k) {
    values.push_back(static_cast<float>(std::cos(2 * M_PI * (wave.At(k).x - 4) / 30)));
  }
  const std::vector<Attribute> attributes = {{"wave", 1, values}};
  Frame frame = wave.AsFrame();
  frame.attributes = attributes;
  SurfaceStream stream({.placement = SurfacePlacement::kVirtualPlane, .box = box});
  ASSERT_TRUE(stream.Try(frame).ok());
  const Surface& surface = stream.surface();
  ASSERT_EQ(surface.attributes[0].values.size(), surface.PointCount());
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    const double x = Coordinate(surface, p, 0);
    EXPECT_NEAR(surface.attributes[0].values[p], std::cos(2 * M_PI * (x - 4) / 30), .05);
  }
}

}  // namespace
}  // namespace partiemc
