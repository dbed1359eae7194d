// Surfaces at plane walls: tanks, drops on a wall, and random frames.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"
#include "space/surface_of.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;
using support::SurfaceOf;
using support::VolumeOf;

Surface AtWalls(const SpaceParticles& particles, const std::vector<WallPlane>& walls) {
  SurfaceWorkspace workspace;
  return SurfaceOf(particles, {.placement = SurfacePlacement::kVirtualPlane, .wall_planes = walls},
                   workspace);
}

double Coordinate(const Surface& surface, std::size_t point, int axis) {
  return surface.points[3 * point + static_cast<std::size_t>(axis)];
}

/// Positive before the wall.
double HeightAbove(const WallPlane& wall, const Surface& surface, std::size_t point) {
  const double from = Coordinate(surface, point, wall.axis) - wall.position;
  return wall.is_fluid_above ? from : -from;
}

double LowestAbove(const WallPlane& wall, const Surface& surface) {
  double lowest = 1e300;
  for (std::size_t point = 0; point < surface.PointCount(); ++point) {
    lowest = std::min(lowest, HeightAbove(wall, surface, point));
  }
  return lowest;
}

/// Particles of a lattice with layers at half spacings above the plane z = floor, where
/// keep(point).
template <typename Keep>
SpaceParticles OnFloor(double floor, double reach, double shake, Random& random, Keep keep) {
  SpaceParticles particles;
  const double dx = random.Unit(), dy = random.Unit();
  const auto shaken = [&] { return random.Uniform(-shake, shake); };
  for (double z = .5; z <= 2 * reach; ++z) {
    for (double y = std::floor(-reach); y <= reach; ++y) {
      for (double x = std::floor(-reach); x <= reach; ++x) {
        const Vec3 at{x + dx, y + dy, z};
        if (!keep(at)) continue;
        const double a = shaken(), b = shaken(), c = shaken();
        particles.Add(at + Vec3{a, b, c + floor});
      }
    }
  }
  return particles;
}

TEST(SurfaceWalls, TanksAreFilledToTheirCorners) {
  for (std::uint64_t seed = 1; seed <= support::Tries(6u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::array<double, 3> low{}, count{};
    for (int k = 0; k < 3; ++k) {
      low[k] = random.Uniform(-20, 20);
      count[k] = static_cast<double>(12 + random.Below(8));
    }
    const double shake = seed % 2 == 0 ? .1 : 0;
    SpaceParticles particles;
    const auto at = [&](int axis, double k) {
      return low[axis] + k + .5 + random.Uniform(-shake, shake);
    };
    for (double z = 0; z < count[2]; ++z) {
      for (double y = 0; y < count[1]; ++y) {
        for (double x = 0; x < count[0]; ++x) {
          const double px = at(0, x), py = at(1, y);
          particles.Add({px, py, at(2, z)});
        }
      }
    }
    const std::vector<WallPlane> walls = {{0, low[0], true},
                                          {0, low[0] + count[0], false},
                                          {1, low[1], true},
                                          {1, low[1] + count[1], false},
                                          {2, low[2], true}};
    const Surface surface = AtWalls(particles, walls);
    ASSERT_EQ(surface.ShellCount(), 1u);
    EXPECT_EQ(surface.measures[0].particles, particles.size());
    const auto particles_volume = static_cast<double>(particles.size());
    EXPECT_NEAR(VolumeOf(surface) / particles_volume, 1, .005);
    for (const WallPlane& wall : walls) EXPECT_EQ(LowestAbove(wall, surface), 0);
    // The four corners of the floor are points.
    for (int corner = 0; corner < 4; ++corner) {
      const double x = walls[corner & 1].position, y = walls[2 + (corner >> 1)].position;
      bool is_point = false;
      for (std::size_t p = 0; p < surface.PointCount(); ++p) {
        is_point = is_point || (Coordinate(surface, p, 0) == x && Coordinate(surface, p, 1) == y &&
                                Coordinate(surface, p, 2) == low[2]);
      }
      EXPECT_TRUE(is_point) << corner;
    }
    double deviation = 0;
    for (std::size_t p = 0; p < surface.PointCount(); ++p) {
      const double height = Coordinate(surface, p, 2) - low[2];
      if (height > count[2] / 2 && LowestAbove(walls[0], surface) == 0) {
        const bool is_on_side = std::any_of(walls.begin(), walls.end() - 1, [&](const auto& wall) {
          return HeightAbove(wall, surface, p) == 0;
        });
        if (!is_on_side) deviation = std::max(deviation, std::abs(height - count[2]));
      }
    }
    std::printf("tank %2.0f x %2.0f x %2.0f, shake %.1f: volume %.5f, top off by at most %.3f\n",
                count[0], count[1], count[2], shake, VolumeOf(surface) / particles_volume,
                deviation);
    EXPECT_LT(deviation, .15);
  }
}

struct DropErrors {
  double free = 0, contact = 0, volume = 0;
};

/// Mean distances of free points and of contact points from a sphere that meets the floor at an
/// angle.
DropErrors ErrorsOfDrop(double degrees, double shake, Random& random) {
  constexpr double kRadius = 10;
  const double angle = degrees * 3.14159265358979323846 / 180;
  const double floor = random.Uniform(-9, 9);
  const Vec3 centre{0, 0, -kRadius * std::cos(angle)};  // Above the floor.
  const SpaceParticles particles =
      OnFloor(floor, 1.2 * kRadius, shake, random,
              [&](const Vec3& at) { return Length(at - centre) < kRadius; });
  const WallPlane wall{2, floor, true};
  const Surface surface = AtWalls(particles, {wall});
  EXPECT_EQ(LowestAbove(wall, surface), 0);
  std::vector<std::uint8_t> on_cap(surface.PointCount()), on_free(surface.PointCount());
  std::size_t cut = 0;
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    const bool is_cut = cut < surface.cuts.size() && surface.cuts[cut] == t;
    cut += is_cut;
    for (int k = 0; k < 3; ++k) (is_cut ? on_cap : on_free)[surface.triangles[3 * t + k]] = 1;
  }
  DropErrors errors;
  double free = 0, contacts = 0;
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    const Vec3 at{Coordinate(surface, p, 0), Coordinate(surface, p, 1),
                  Coordinate(surface, p, 2) - floor};
    const double distance = std::abs(Length(at - centre) - kRadius);
    if (on_cap[p] == 0) {
      errors.free += distance;
      ++free;
    } else if (on_free[p] != 0) {
      errors.contact += std::abs(std::hypot(at.x, at.y) - kRadius * std::sin(angle));
      ++contacts;
    }
  }
  errors.free /= free;
  errors.contact /= contacts;
  errors.volume = VolumeOf(surface) / static_cast<double>(particles.size()) - 1;
  return errors;
}

/// Attributes have values at points only, so wetted faces have inner points then.
TEST(SurfaceWalls, AttributesVaryOverTheFloor) {
  Random random(4);
  const SpaceParticles particles = OnFloor(
      -3, 9, .1, random, [](const Vec3& at) { return at.z < 6 && std::hypot(at.x, at.y) < 9; });
  const auto value_at = [](double x, double y) { return 1 + .05 * x * y; };
  std::vector<float> values;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    values.push_back(static_cast<float>(value_at(particles.At(k).x, particles.At(k).y)));
  }
  const std::vector<Attribute> attributes = {{"value", 1, values}};
  Frame frame = particles.AsFrame();
  frame.attributes = attributes;
  for (const double simplify : {0.0, .05}) {
    SCOPED_TRACE(simplify);
    const auto reconstructor =
        SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane,
                                      .simplify = simplify,
                                      .wall_planes = {{2, -3, true}}});
    SurfaceWorkspace workspace;
    Surface surface;
    ASSERT_TRUE(reconstructor->Reconstruct(frame, workspace, surface).ok());
    EXPECT_TRUE(Validate(surface).ok()) << Validate(surface);
    double largest = 0;
    int inner = 0;
    for (std::size_t t : surface.cuts) {
      std::array<Vec3, 3> at;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t point = surface.triangles[3 * t + k];
        at[k] = Vec3At(surface.points, point);
        if (std::hypot(at[k].x, at[k].y) > 7) continue;
        ++inner;
        EXPECT_NEAR(surface.attributes[0].values[point], value_at(at[k].x, at[k].y), .15);
      }
      largest = std::max(largest, Length(Cross(at[1] - at[0], at[2] - at[0])) / 2);
    }
    EXPECT_EQ(inner > 0, simplify == 0);
    EXPECT_EQ(largest < 8, simplify == 0) << largest;
  }
}

TEST(SurfaceWalls, DropsKeepTheirShapeAtAWall) {
  const auto tries = support::Tries(3u);
  for (const double degrees : {60., 90., 120.}) {
    for (const double shake : {0., .2}) {
      DropErrors mean;
      for (std::uint64_t seed = 1; seed <= tries; ++seed) {
        Random random(100 * seed + static_cast<std::uint64_t>(degrees));
        const DropErrors errors = ErrorsOfDrop(degrees, shake, random);
        mean.free += errors.free / static_cast<double>(tries);
        mean.contact += errors.contact / static_cast<double>(tries);
        mean.volume = std::max(mean.volume, std::abs(errors.volume));
      }
      std::printf("drop %3.0f degrees, shake %.1f: free %.3f, contact %.3f, volume off by %.4f\n",
                  degrees, shake, mean.free, mean.contact, mean.volume);
      EXPECT_LT(mean.free, .12);
      EXPECT_LT(mean.contact, degrees == 90 ? .15 : .7);
      EXPECT_LT(mean.volume, .003);
    }
  }
}

std::vector<WallPlane> RandomWalls(const SpaceParticles& particles, Random& random) {
  std::vector<WallPlane> walls;
  for (std::size_t k = random.Below(4) + 1; k > 0; --k) {
    const int axis = static_cast<int>(random.Below(3));
    const Vec3 at = particles.At(random.Below(particles.size()));
    const double through = axis == 0 ? at.x : axis == 1 ? at.y : at.z;
    // Some walls pass through nodes of the lattice.
    const double position =
        random.Chance(.3) ? std::floor(through) : through + random.Uniform(-2, 2);
    const bool is_above = random.Chance(.5);
    const bool fits = std::all_of(walls.begin(), walls.end(), [&](const WallPlane& other) {
      if (other.axis != axis) return true;
      const double gap = is_above ? other.position - position : position - other.position;
      return other.is_fluid_above != is_above && gap >= 3;
    });
    if (fits) walls.push_back({axis, position, is_above});
  }
  return walls;
}

TEST(SurfaceWalls, RandomFramesKeepTheGuarantees) {
  SurfaceWorkspace workspace;
  std::size_t with_cuts = 0;
  const std::uint64_t frames = support::Tries(150u);
  for (std::uint64_t seed = 1; seed <= frames; ++seed) {
    SCOPED_TRACE(seed);
    const SpaceParticles particles = support::RandomSpaceScene(seed);
    if (particles.size() == 0) continue;
    Random random(seed);
    const std::vector<WallPlane> walls = RandomWalls(particles, random);
    const auto placement = seed % 4 == 0   ? SurfacePlacement::kMarchingCubes
                           : seed % 4 == 1 ? SurfacePlacement::kQef
                                           : SurfacePlacement::kVirtualPlane;
    const Surface surface = SurfaceOf(
        particles,
        {.placement = placement, .simplify = random.Chance(.2) ? .1 : 0, .wall_planes = walls},
        workspace);
    with_cuts += surface.cuts.empty() ? 0 : 1;
    for (const WallPlane& wall : walls) ASSERT_GE(LowestAbove(wall, surface), 0);
    if (HasFailure()) break;
  }
  EXPECT_GT(with_cuts, frames / 4);
}

TEST(SurfaceWalls, BitsDependNeitherOnThreadsNorOnOrder) {
  Random random(5);
  SpaceParticles particles = support::Ball({0, 0, 0}, 7, .3, random);
  particles.Add(support::Box({-9, -9, -7}, {9, 9, -5}, .2, random));
  const std::vector<WallPlane> walls = {{2, -7.5, true}, {0, -4, true}, {1, 8.25, false}};
  const SurfaceParameters parameters{.placement = SurfacePlacement::kVirtualPlane,
                                     .wall_planes = walls};
  std::vector<Surface> surfaces;
  for (const unsigned threads : {1u, 2u}) {
    const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, threads);
    Arena arena(threads);
    arena.Execute([&] {
      SurfaceWorkspace workspace;
      surfaces.push_back(SurfaceOf(particles, parameters, workspace));
    });
  }
  SurfaceWorkspace workspace;
  surfaces.push_back(SurfaceOf(support::Shuffled(particles, random), parameters, workspace));
  EXPECT_FALSE(surfaces[0].cuts.empty());
  EXPECT_EQ(surfaces[1], surfaces[0]);
  EXPECT_EQ(surfaces[2], surfaces[0]);
}

TEST(SurfaceWalls, ParticlesFarBehindAWallHaveNoEffect) {
  Random random(6);
  const SpaceParticles before = support::Ball({0, 0, 6}, 5, .2, random);
  SpaceParticles all = before;
  all.Add(support::Ball({0, 0, -4}, 3, .2, random));
  const std::vector<WallPlane> walls = {{2, 0, true}};
  EXPECT_EQ(AtWalls(all, walls), AtWalls(before, walls));
  // Only particles behind the wall: an empty surface.
  EXPECT_EQ(AtWalls(all, {{2, 30, true}}).ShellCount(), 0u);
}

TEST(SurfaceWalls, AWallFarFromTheFluidChangesNothing) {
  Random random(7);
  const SpaceParticles particles = support::Ball({0, 0, 0}, 6, .2, random);
  const Surface without = AtWalls(particles, {});
  const Surface far = AtWalls(particles, {{2, -40, true}, {0, 31, false}});
  EXPECT_TRUE(far.cuts.empty());
  EXPECT_EQ(far.triangles, without.triangles);
  ASSERT_EQ(far.points.size(), without.points.size());
  // Volumes are summed in another way.
  for (std::size_t k = 0; k < far.points.size(); ++k) {
    ASSERT_NEAR(far.points[k], without.points[k], 1e-9);
  }
}

// A wall at 1e30 stands for none. Planes of one axis once moved alike, and this one moved the floor
// into the fluid.
TEST(SurfaceWalls, AWallAtAnyDistanceLeavesTheOppositeWall) {
  Random random(3);
  const SpaceParticles particles = OnFloor(
      0, 5, .1, random, [](const Vec3& at) { return std::abs(at.x) < 5 && std::abs(at.y) < 5; });
  const WallPlane floor{.axis = 2};
  const Surface alone = AtWalls(particles, {floor});
  ASSERT_GT(alone.ShellCount(), 0u);
  for (const double far : {1e6, 1e12, 1e16, 1e30, 1e60}) {
    const WallPlane ceiling{.axis = 2, .position = far, .is_fluid_above = false};
    const Surface surface = AtWalls(particles, {floor, ceiling});
    EXPECT_NEAR(VolumeOf(surface), VolumeOf(alone), 1e-6 * VolumeOf(alone)) << far;
  }
}

TEST(SurfaceWalls, ParticlesOnAWallAndBehindItKeepTheirVolume) {
  const std::vector<WallPlane> corner = {{.axis = 0}, {.axis = 1}, {.axis = 2}};
  const std::vector<std::pair<Vec3, std::vector<WallPlane>>> places = {{{0, 0, 0}, {corner[2]}},
                                                                       {{0, 0, -.3}, {corner[2]}},
                                                                       {{0, 0, 0}, corner},
                                                                       {{-.3, -.3, -.3}, corner}};
  for (const auto& [place, walls] : places) {
    SpaceParticles one;
    one.Add(place);
    EXPECT_NEAR(VolumeOf(AtWalls(one, walls)), 1, .05) << place.x << ' ' << place.z;
  }
  for (const int side : {2, 3}) {
    SpaceParticles cube;
    for (int k = 0; k < side * side * side; ++k) {
      cube.Add({1. * (k % side), 1. * (k / side % side), 1. * (k / side / side)});
    }
    const double volume = side * side * side;
    EXPECT_NEAR(VolumeOf(AtWalls(cube, {corner[2]})), volume, .05 * volume) << side;
  }
}

TEST(SurfaceWalls, DropsAndBodiesKeepTheirIdentities) {
  Random random(8);
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = SurfacePlacement::kVirtualPlane, .wall_planes = {{2, 0, true}}});
  ASSERT_TRUE(reconstructor.ok());
  SpaceParticles particles = support::Ball({0, 0, 3}, 5, .1, random);
  particles.Add(support::Box({20, 0, .5}, {21.5, 1.5, 1.5}, 0, random));
  SurfaceState state;
  SurfaceWorkspace workspace;
  std::vector<std::uint64_t> first;
  for (int frame = 0; frame < 3; ++frame) {
    Surface surface;
    ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), state, workspace, surface).ok());
    const absl::Status valid = Validate(surface);
    ASSERT_TRUE(valid.ok()) << valid;
    ASSERT_EQ(surface.ShellCount(), 2u);
    std::vector<std::uint64_t> identities;
    for (const ShellMeasures& measures : surface.measures) identities.push_back(measures.identity);
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
    EXPECT_NE(identities[0], 0u);
    EXPECT_NE(identities[1], 0u);
    for (std::size_t k = 0; k < particles.xyz.size(); k += 3) particles.xyz[k] += .2;
  }
}

TEST(SurfaceWalls, FarParticleIsNamedByItsOwnNumber) {
  const auto reconstructor = Reconstructor::Create(
      {.output = Output::kSurface, .spacing = 1.0, .wall_planes = {{0, 0, true}}});
  ASSERT_TRUE(reconstructor.ok());
  const std::vector<double> xyz = {-9, 0, 0, 1, 0, 0, 1, 1e12, 0};  // The first one is dropped.
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(
      {.positions = std::span<const double>(xyz), .components = 3}, state, workspace, result);
  ASSERT_TRUE(FindViolation(status).has_value()) << status;
  EXPECT_EQ(FindViolation(status)->field, "positions[2].y");
}

TEST(SurfaceWalls, WrongWallsAreRefused) {
  struct Case {
    ReconstructionParameters parameters;
    const char* field;
  };
  ReconstructionParameters surface{.output = Output::kSurface, .spacing = 1};
  const auto with = [&](std::vector<WallPlane> walls) {
    ReconstructionParameters parameters = surface;
    parameters.wall_planes = std::move(walls);
    return parameters;
  };
  std::vector<Case> cases = {
      {with({{3, 0, true}}), "wall_planes[0].axis"},
      {with({{-1, 0, true}}), "wall_planes[0].axis"},
      {with({{0, NAN, true}}), "wall_planes[0].position"},
      {with({{0, 1e61, true}}), "wall_planes[0].position"},
      {with({{0, 0, true}, {0, 9, true}}), "wall_planes[1]"},
      {with({{0, 0, true}, {0, 2.9, false}}), "wall_planes[1].position"},
      {with({{0, 0, true}, {0, -9, false}}), "wall_planes[1].position"},
      {with(std::vector<WallPlane>(7)), "wall_planes"},
  };
  for (int k = 0; k < 2; ++k) {
    ReconstructionParameters parameters = with({{0, 0, true}});
    if (k == 0) parameters.output = Output::kOutline;
    if (k == 1) parameters.sections = {{.slice = SlicePlane{}}};
    cases.push_back({parameters, "wall_planes"});
  }
  // A wall may be parallel to a periodic axis, but not across it.
  ReconstructionParameters in_box = with({{1, 0, true}, {0, 0, true}});
  in_box.box = PeriodicBox{.axes = {std::nullopt, std::nullopt, PeriodicAxis{0, 40}}};
  EXPECT_TRUE(Validate(in_box).ok());
  in_box.box->axes[0] = PeriodicAxis{0, 40};
  cases.push_back({in_box, "wall_planes[1].axis"});
  for (const Case& wrong : cases) {
    SCOPED_TRACE(wrong.field);
    const absl::Status status = Validate(wrong.parameters);
    ASSERT_TRUE(FindViolation(status).has_value()) << status;
    EXPECT_EQ(FindViolation(status)->field, "parameters." + std::string(wrong.field));
  }
  EXPECT_TRUE(Validate(with({{0, 0, true}, {0, 3, false}, {1, 0, false}})).ok());
}

}  // namespace
}  // namespace partiemc
