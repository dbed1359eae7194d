// The steps of the placements in space.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "frame/calibration.h"
#include "frame/scale.h"
#include "partiemc/surface_reconstructor.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/point_sampler.h"
#include "space/space_particles.h"
#include "space/surface_of.h"
#include "space_vertices/body_volumes.h"
#include "space_vertices/edge_vertices.h"
#include "space_vertices/loop_filters.h"
#include "space_vertices/loop_windows.h"
#include "space_vertices/qef.h"
#include "space_vertices/roots.h"
#include "space_vertices/vertices.h"
#include "support/tries.h"

namespace partiemc::space {
namespace {

using support::Ball;
using support::Random;
using support::SpaceParticles;
using support::VolumeOf;

/// All stages up to the anchors, for particles of spacing 1 and cells of size 1.
struct Anchored {
  Scale scale;
  SpaceBins bins;
  SpaceField field;
  SpaceCrossings crossings;
  Bodies bodies;
  std::vector<Vec3> anchors;

  explicit Anchored(const SpaceParticles& particles) {
    ReconstructionParameters parameters;
    parameters.reference_radius = CalibratedSliceRadius(3);
    parameters.slice = SlicePlane{};
    scale = MakeScale(parameters, 1, 1, 1);
    EXPECT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
    SampleField(bins, scale, field);
    FindCrossings(bins.bricks, field, crossings);
    ListSteps(bins.bricks, crossings);
    EvaluateNodes(bins, scale, crossings.near, field);
    FindBodies(particles.AsFrame(), bins, field, 1, 3, bodies);
    PlaceOnCrossings(bins.bricks, field, crossings, kAnchorMargin, anchors);
  }

  std::vector<Vec3> Loops(const std::vector<Vec3>& by_vertex) const {
    return {by_vertex.begin() + crossings.edge_count, by_vertex.end()};
  }
};

constexpr double kRadius = 6;

/// The loops of a window, sorted.
std::vector<std::uint32_t> WindowOf(const LoopWindows& windows, std::uint32_t loop) {
  std::vector<std::uint32_t> found;
  for (std::size_t index = 0; index < windows.chunk_count; ++index) {
    const LoopWindows::Chunk& chunk = windows.chunks[index];
    if (loop < chunk.begin || loop >= chunk.end) continue;
    EXPECT_EQ(chunk.near[chunk.self[loop - chunk.begin]], loop);
    for (std::size_t k = 0; k < chunk.near.size(); ++k) {
      if ((chunk.Of(loop)[k / 32] >> k % 32 & 1) != 0) found.push_back(chunk.near[k]);
    }
  }
  return found;
}

/// The loops of a ball, moved to the sphere.
struct OnSphere : Anchored {
  std::vector<Vec3> centres, normals;
  std::vector<double> areas;
  LoopWindows windows;

  explicit OnSphere(double reach) : Anchored(MakeBall()) {
    for (const Vec3& at : Loops(anchors)) {
      normals.push_back(Normalised(at));
      centres.push_back(kRadius * normals.back());
      areas.push_back(1);
    }
    FindWindows(bins.bricks, crossings, centres, reach, windows);
  }

  /// Sets the areas to those of the triangles around the loops.
  void MeasureAreas() {
    std::vector<Vec3> positions = anchors;
    std::copy(centres.begin(), centres.end(), positions.begin() + crossings.edge_count);
    for (std::uint32_t v = 0; v < crossings.edge_count; ++v) {
      positions[v] = kRadius * Normalised(positions[v]);
    }
    BodyVolumes volumes;
    FindBodyOfVertices(bins.bricks, field, crossings, bodies, volumes);
    MeasureBodies(bins.bricks, crossings, 1, bodies, positions, volumes);
    areas = volumes.areas;
  }

  static SpaceParticles MakeBall() {
    Random random(1);
    return Ball({0, 0, 0}, kRadius, .2, random);
  }
};

TEST(LoopWindows, ContainTheLoopsWithinReach) {
  constexpr double kReach = 2.5;
  const OnSphere ball(kReach);
  ASSERT_GT(ball.centres.size(), 300u);
  for (std::uint32_t i = 0; i < ball.centres.size(); ++i) {
    std::vector<std::uint32_t> expected;
    for (std::uint32_t j = 0; j < ball.centres.size(); ++j) {
      const Vec3 to = ball.centres[j] - ball.centres[i];
      if (Dot(to, to) < kReach * kReach) expected.push_back(j);
    }
    EXPECT_EQ(WindowOf(ball.windows, i), expected);
  }
}

TEST(LoopWindows, KeepBodiesApart) {
  Random random(2);
  SpaceParticles particles = Ball({0, 0, 0}, 3, 0, random);
  particles.Add(Ball({0, 0, 8}, 3, 0, random));
  const Anchored two(particles);
  ASSERT_EQ(two.bodies.bodies.size(), 2u);
  LoopWindows windows;
  const std::vector<Vec3> centres = two.Loops(two.anchors);
  FindWindows(two.bins.bricks, two.crossings, centres, 6, windows);
  for (std::uint32_t i = 0; i < centres.size(); ++i) {
    for (const std::uint32_t j : WindowOf(windows, i)) {
      EXPECT_EQ(centres[i].z < 4, centres[j].z < 4);
    }
  }
}

TEST(LoopFilters, LeaveASphereUnchanged) {
  const OnSphere ball(4);
  const LoopSurface surface{ball.windows, ball.centres, ball.areas};
  std::vector<double> bends(ball.centres.size());
  FindBends(surface, ball.normals, 2.5, 2, bends);
  for (const double bend : bends) EXPECT_NEAR(bend, 2 / kRadius, 1e-6);
  std::vector<Vec3> smooth(ball.centres.size());
  const std::vector<double> no_bases(ball.centres.size());
  SmoothOnPlanes(surface, ball.normals, no_bases, 4, smooth);
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    EXPECT_LT(Length(smooth[i] - ball.centres[i]), 1e-6);
  }
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Mean errors of the filters on a ball whose normals and centres have been disturbed.
struct FilterErrors {
  double normals_before = 0, normals = 0, heights_before = 0, heights = 0;

  FilterErrors(double of_normals, double of_heights) {
    OnSphere ball(4);
    Random random(3);
    const std::vector<Vec3> truth = ball.normals;
    const std::size_t count = truth.size();
    std::vector<double> noise(count), height(count), rest(count), rest_of_height(count);
    const auto along = [&] { return random.Uniform(-of_normals, of_normals); };
    for (std::size_t i = 0; i < count; ++i) {
      const double x = along(), y = along();
      ball.normals[i] = Normalised(truth[i] + Vec3{x, y, along()});
      noise[i] = Length(ball.normals[i] - truth[i]);
      const double by = random.Uniform(-of_heights, of_heights);
      ball.centres[i] = ball.centres[i] + by * truth[i];
      height[i] = std::abs(by);
    }
    ball.MeasureAreas();
    const LoopSurface surface{ball.windows, ball.centres, ball.areas};
    std::vector<Vec3> once(count), twice(count), smooth(count);
    SmoothNormals(surface, ball.normals, 2.5, Stop::kNowhere, once);
    SmoothNormals(surface, once, 4, Stop::kAtEdges, twice);
    SmoothOnPlanes(surface, twice, std::vector<double>(count), 4, smooth);
    for (std::size_t i = 0; i < count; ++i) {
      rest[i] = Length(twice[i] - truth[i]);
      rest_of_height[i] = std::abs(Length(smooth[i]) - kRadius);
    }
    normals_before = Mean(noise);
    normals = Mean(rest);
    heights_before = Mean(height);
    heights = Mean(rest_of_height);
  }
};

TEST(LoopFilters, ReduceNoiseOfNormalsAndHeights) {
  const FilterErrors errors(.2, .1);
  EXPECT_LT(errors.normals, .35 * errors.normals_before);
  EXPECT_LT(errors.heights, .4 * errors.heights_before);
}

TEST(LoopFilters, HardlyDisturbANormalWithoutNoise) {
  // Loops are not evenly spread: equal areas would turn normals by .03.
  EXPECT_LT(FilterErrors(0, .1).normals, .01);
  EXPECT_LT(FilterErrors(0, 0).heights, 1e-3);
}

TEST(EdgeVertices, LieOnTheSphereOfTheirLoops) {
  const OnSphere ball(1);
  std::vector<Vec3> positions = ball.anchors, normals(ball.anchors.size());
  const std::uint32_t first = ball.crossings.edge_count;
  std::copy(ball.centres.begin(), ball.centres.end(), positions.begin() + first);
  std::copy(ball.normals.begin(), ball.normals.end(), normals.begin() + first);
  PlaceEdgesByLoops(ball.bins.bricks, ball.crossings, ball.anchors, positions, normals);
  for (std::uint32_t v = 0; v < first; ++v) {
    EXPECT_NEAR(Length(positions[v]), kRadius, .02);
    EXPECT_NEAR(Length(normals[v]), 1, 1e-12);
  }
}

TEST(Roots, LieOnTheLevelSet) {
  const Anchored ball(OnSphere::MakeBall());
  std::vector<Vec3> positions = ball.anchors, normals;
  const RootConstants constants;
  FindRoots(ball.bins, ball.scale, ball.crossings, constants, positions, normals);
  PointSampler sampler(ball.bins, ball.scale);
  std::vector<double> before, after, free_before, free_after;
  for (const ActiveCell& cell : ball.crossings.cells) {
    const auto x = static_cast<float>(cell.i), y = static_cast<float>(cell.j),
               z = static_cast<float>(cell.k);
    sampler.MoveTo(cell.brick, {{x, y, z}, {x + 1, y + 1, z + 1}});
    const Vec3 origin = OriginOf(ball.bins.bricks[cell.brick]);
    const Vec3 anchor = ball.anchors[cell.first_loop], at = positions[cell.first_loop];
    EXPECT_GT(Dot(normals[cell.first_loop], Normalised(at)), .7);
    before.push_back(std::abs(sampler.Value(anchor - origin)));
    after.push_back(std::abs(sampler.Value(at - origin)));
    // Some steps end at the limit or at the cell.
    const Vec3 from_middle = at - origin - Vec3{x + .5, y + .5, z + .5};
    const double most =
        std::max({std::abs(from_middle.x), std::abs(from_middle.y), std::abs(from_middle.z)});
    if (most > .4999 - kAnchorMargin || Length(at - anchor) > .999 * constants.newton_step)
      continue;
    free_before.push_back(before.back());
    free_after.push_back(after.back());
  }
  EXPECT_GT(3 * free_after.size(), 2 * after.size());
  EXPECT_LT(Mean(free_after), .05 * Mean(free_before));
  EXPECT_LT(Mean(after), .5 * Mean(before));
}

TEST(Qef, FindsTheCornerOfThreePlanes) {
  Random random(4);
  for (int trial = 0; trial < support::Tries(200); ++trial) {
    const auto along = [&] { return random.Uniform(-1, 1); };
    const auto vector = [&] {
      const double x = along(), y = along();
      return Vec3{x, y, along()};
    };
    const Vec3 corner = vector();
    std::array<Vec3, 3> normals;
    do {
      for (Vec3& normal : normals) normal = Normalised(vector());
    } while (std::abs(Dot(normals[0], Cross(normals[1], normals[2]))) < .5);
    std::vector<TangentPlane> planes;
    Vec3 mean;
    for (const Vec3& normal : normals) {
      for (int k = 0; k < 4; ++k) {
        planes.push_back({corner + Cross(normal, vector()), normal});
        mean = mean + (1.0 / 12) * planes.back().point;
      }
    }
    EXPECT_LT(Length(LeastSquarePoint(planes, mean) - corner), .1 * Length(mean - corner));
    // Planes without a corner: the point of the plane nearest to the mean.
    const std::vector<TangentPlane> flat(planes.begin(), planes.begin() + 4);
    const Vec3 foot = mean - Dot(mean - corner, normals[0]) * normals[0];
    EXPECT_LT(Length(LeastSquarePoint(flat, mean) - foot), .02 * Length(mean - corner));
  }
}

TEST(Qef, FollowsFacesAndCornersOfABox) {
  Random random(4);
  const Anchored box(support::Box({0, 0, 0}, {9, 9, 9}, 0, random));
  std::vector<Vec3> positions = box.anchors, normals;
  PlaceByQef(box.bins, box.scale, box.crossings, positions, normals);
  const auto from_middle = [](const Vec3& at) {
    return Vec3{std::abs(at.x - 4.5), std::abs(at.y - 4.5), std::abs(at.z - 4.5)};
  };
  int on_faces = 0, corners = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    EXPECT_NEAR(Length(normals[v]), 1, 1e-12);
    const Vec3 at = from_middle(positions[v]), anchor = from_middle(box.anchors[v]);
    if (at.x <= 1 && at.y <= 1) {
      EXPECT_GT(std::abs(normals[v].z), .999);
      EXPECT_NEAR(at.z, 5, .15);
      ++on_faces;
    }
    // The mean of the crossings cuts the corner off.
    if (v >= box.crossings.edge_count && std::min({anchor.x, anchor.y, anchor.z}) > 4.2) {
      EXPECT_GT(std::min({at.x, at.y, at.z}), std::min({anchor.x, anchor.y, anchor.z}) + .04);
      ++corners;
    }
  }
  EXPECT_GT(on_faces, 4);
  EXPECT_EQ(corners, 8);
}

SpaceParticles Drop(int count, Random& random) {
  // The lattice points nearest to a random centre, shaken.
  const double x = random.Unit(), y = random.Unit();
  const Vec3 centre{x, y, random.Unit()};
  double radius = 0;
  SpaceParticles drop;
  while (drop.size() < static_cast<std::size_t>(count)) {
    radius += .05;
    Random same(7);
    drop = Ball(centre, radius, .1, same);
  }
  return drop;
}

TEST(VirtualPlane, GivesDropsAndBallsTheVolumeOfTheirParticles) {
  const auto reconstructor =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane});
  SurfaceWorkspace workspace;
  Surface surface;
  Random random(5);
  for (const int count : {1, 2, 4, 8, 12, 20, 30, 60, 100, 300, 1000}) {
    double least = 1, most = 1;
    for (int trial = 0; trial < 20; ++trial) {
      const SpaceParticles drop = Drop(count, random);
      ASSERT_TRUE(reconstructor->Reconstruct(drop.AsFrame(), workspace, surface).ok());
      ASSERT_TRUE(Validate(surface).ok());
      const double ratio = VolumeOf(surface) / static_cast<double>(drop.size());
      least = std::min(least, ratio);
      most = std::max(most, ratio);
    }
    std::printf("%d particles: volume %.3f to %.3f\n", count, least, most);
    const double error = count < 20 ? .06 : .02;
    EXPECT_GT(least, 1 - error) << count;
    EXPECT_LT(most, 1 + error) << count;
  }
}

TEST(VolumeSearch, ABodyWhoseErrorHasGrownReturnsForGood) {
  Bodies bodies;
  bodies.bodies.resize(2);
  for (Body& body : bodies.bodies) body.volume = 1;
  BodyVolumes volumes;
  volumes.body_of = {0, 1};
  const std::vector<Vec3> normals(2, Vec3{0, 0, 1});
  std::vector<Vec3> positions(2);
  BeginSearch(bodies, positions, {}, volumes);
  const auto search = [&](double first, double second, double limit = 1) {
    volumes.measures = {{.area = 2, .volume = first}, {.area = 2, .volume = second}};
    return SearchVolumes(bodies, {.limit = limit, .tolerance = .01}, normals, volumes, positions);
  };
  EXPECT_TRUE(search(1.5, 1.5));
  EXPECT_DOUBLE_EQ(positions[0].z, -.25);
  EXPECT_DOUBLE_EQ(positions[1].z, -.25);
  EXPECT_TRUE(search(1.4, 1.3));  // Both are better, and move on.
  EXPECT_DOUBLE_EQ(positions[0].z, -.45);
  EXPECT_DOUBLE_EQ(positions[1].z, -.4);
  EXPECT_EQ(volumes.steps, (std::vector{BodyStep::kIsSaved, BodyStep::kIsSaved}));
  EXPECT_TRUE(search(1.6, 1.2));
  EXPECT_EQ(volumes.steps, (std::vector{BodyStep::kReturns, BodyStep::kIsSaved}));
  EXPECT_DOUBLE_EQ(positions[0].z, -.25);
  EXPECT_DOUBLE_EQ(positions[1].z, -.5);
  EXPECT_TRUE(search(1.7, 1.1));
  EXPECT_EQ(volumes.steps, (std::vector{BodyStep::kGoesOn, BodyStep::kIsSaved}));
  EXPECT_DOUBLE_EQ(positions[0].z, -.25) << "it stays";
  EXPECT_DOUBLE_EQ(positions[1].z, -.55);
  EXPECT_FALSE(search(1.7, 1.05, 0)) << "a limit of 0 only returns bodies";
  EXPECT_TRUE(search(1.7, 1.3, 0));
  EXPECT_DOUBLE_EQ(positions[1].z, -.55);
}

TEST(VirtualPlane, GivesSheetsOfOneLayerTheVolumeOfTheirParticles) {
  const auto reconstructor =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane});
  SurfaceWorkspace workspace;
  Surface surface;
  Random random(9);
  for (const double thickness : {.2, .6, 1.0}) {
    for (int trial = 0; trial < 6; ++trial) {
      constexpr int kCount = 600;
      SpaceParticles sheet;
      while (sheet.size() < kCount) {
        sheet.Add({random.Uniform(0, 26), random.Uniform(0, 26), random.Uniform(0, thickness)});
      }
      ASSERT_TRUE(reconstructor->Reconstruct(sheet.AsFrame(), workspace, surface).ok());
      EXPECT_NEAR(VolumeOf(surface) / kCount, 1, .005) << thickness;
    }
  }
}

/// The corners of all triangles, sorted by the triangles' first corners.
std::vector<std::array<double, 9>> CornersOf(const Surface& surface) {
  std::vector<std::array<double, 9>> corners(surface.TriangleCount());
  for (std::size_t i = 0; i < 9 * corners.size(); ++i) {
    corners[i / 9][i % 9] = surface.points[3 * std::size_t{surface.triangles[i / 3]} + i % 3];
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

// Steps of the search for volumes fail most in sheets of one layer, and in drops of darts.
TEST(VirtualPlane, BodiesFarApartDoNotInfluenceEachOther) {
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = SurfacePlacement::kVirtualPlane, .max_drop_particles = 0});
  SurfaceWorkspace workspace;
  Surface surface;
  Random random(12);
  for (int trial = 0; trial < support::Tries(10); ++trial) {
    SpaceParticles all;
    std::vector<std::array<double, 9>> apart;
    for (int body = 0; body < 4; ++body) {
      const Vec3 low{100.0 * body, 0, 0};
      const double thickness = random.Uniform(.1, body < 2 ? 1.2 : 4);
      SpaceParticles particles;
      while (particles.size() < 200) {
        particles.Add(
            low + Vec3{random.Uniform(0, 14), random.Uniform(0, 14), random.Uniform(0, thickness)});
      }
      all.Add(particles);
      ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
      const auto corners = CornersOf(surface);
      apart.insert(apart.end(), corners.begin(), corners.end());
    }
    ASSERT_TRUE(reconstructor->Reconstruct(all.AsFrame(), workspace, surface).ok());
    EXPECT_TRUE(CornersOf(surface) == apart) << trial;
  }
}

// Darts in a ball anywhere in the lattice, without ellipsoids. Some of them are nearly apart.
TEST(VirtualPlane, GivesMostDropsOfDartsTheVolumeOfTheirParticles) {
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = SurfacePlacement::kVirtualPlane, .max_drop_particles = 0});
  SurfaceWorkspace workspace;
  Surface surface;
  Random random(11);
  const int trials = support::Tries(100);
  int wrong = 0;
  for (const int count : {20, 30, 60, 120}) {
    const double radius = std::cbrt(.75 * count / std::numbers::pi);
    for (int trial = 0; trial < trials; ++trial) {
      const Vec3 centre{random.Unit(), random.Unit(), random.Unit()};
      SpaceParticles drop;
      while (drop.size() < static_cast<std::size_t>(count)) {
        const Vec3 arm{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
        if (Length(arm) < 1) drop.Add(centre + radius * arm);
      }
      ASSERT_TRUE(reconstructor->Reconstruct(drop.AsFrame(), workspace, surface).ok());
      wrong += std::abs(VolumeOf(surface) - count) > .1 * count;
    }
  }
  EXPECT_LE(wrong, 1 + trials / 50) << "of " << 4 * trials;
}

}  // namespace
}  // namespace partiemc::space
