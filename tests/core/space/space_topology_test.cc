// Surfaces of random signs and of random particles keep S1 to S5.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/bodies.h"
#include "space/cell_loops.h"
#include "space/crossings.h"
#include "space/mesh.h"
#include "space/space_particles.h"
#include "space_certificate/certificate.h"
#include "space_vertices/thinning.h"
#include "space_vertices/vertices.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Random;
using support::RandomSpaceScene;
using support::Shuffled;
using support::SpaceParticles;

TEST(CellLoops, CoverEveryCrossingOnce) {
  for (unsigned corners = 0; corners < 256; ++corners) {
    const space::CellLoops& loops = space::LoopsOf(corners);
    unsigned crossed = 0;
    for (int edge = 0; edge < 12; ++edge) {
      const int low = space::LowCornerOfEdge(edge);
      const int high = low | 1 << space::AxisOfEdge(edge);
      crossed |= ((corners >> low ^ corners >> high) & 1) << edge;
    }
    unsigned visited = 0;
    for (int step = 0; step < loops.Steps(); ++step) {
      EXPECT_EQ(visited >> loops.edge[step] & 1, 0u);
      visited |= 1u << loops.edge[step];
    }
    EXPECT_EQ(visited, crossed);
    for (int loop = 0; loop < loops.loops; ++loop) {
      const int size = loops.first[loop + 1] - loops.first[loop];
      EXPECT_GE(size, 3);
      EXPECT_EQ(space::TrianglesOf(corners, loop).count, size - 2) << corners;
    }
  }
}

TEST(CellLoops, MatchAcrossFaces) {
  for (unsigned corners = 0; corners < 256; ++corners) {
    const space::CellLoops& loops = space::LoopsOf(corners);
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      // The mirrored cell has the same corners on the common face.
      unsigned other = 0;
      for (int corner = 0; corner < 8; ++corner) {
        other |= (corners >> (corner ^ 1 << face / 2) & 1) << corner;
      }
      const space::CellLoops& across = space::LoopsOf(other);
      const int from = space::EdgeAcross(loops.edge[loops.Next(step)], face);
      const int to = space::EdgeAcross(loops.edge[step], face);
      int found = 0;
      for (int k = 0; k < across.Steps(); ++k) {
        found += across.edge[k] == from && across.edge[across.Next(k)] == to &&
                 across.face[k] == (face ^ 1);
      }
      EXPECT_EQ(found, 1);
    }
  }
}

/// Eight bricks with given values at their nodes.
struct Signs {
  space::SpaceBins bins;
  space::SpaceField field;
  space::SpaceCrossings crossings;
  space::Bodies bodies;

  /// `value_at(x, y, z)`: negative inside, for 0 <= x, y, z < 16, counted from the brick
  /// (first, first, first).
  template <typename ValueAt>
  explicit Signs(const ValueAt& value_at, std::int32_t first = 0) {
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) bins.bricks.Insert({first + z, first + y, first + x});
      }
    }
    bins.bricks.Seal();
    bins.cells.assign(8, {});
    field.values.resize(8);
    field.inside.resize(8);
    for (std::uint32_t brick = 0; brick < 8; ++brick) {
      const auto [bz, by, bx] = bins.bricks[brick];
      for (int node = 0; node < space::kBrickNodes; ++node) {
        const space::BrickPlace at{brick, node % 8, node / 8 % 8, node / 64};
        const double value =
            value_at(8 * (bx - first) + at.i, 8 * (by - first) + at.j, 8 * (bz - first) + at.k);
        field.values[brick][node] = static_cast<float>(value);
        field.inside[brick][at.k] |= std::uint64_t{value < 0} << at.Bit();
      }
    }
    FindCrossings(bins.bricks, field, crossings);
    ListSteps(bins.bricks, crossings);
    FindBodies({}, bins, field, 1, 3, bodies);
  }
};

/// Random values at the inner nodes.
Signs RandomSigns(std::uint64_t seed, std::int32_t first = 0) {
  Random random(seed);
  const double density = random.Uniform(.05, .95);
  const bool is_even = random.Chance(.2);
  const auto value_at = [&](int x, int y, int z) {
    const bool is_inner = x > 3 && x < 12 && y > 3 && y < 12 && z > 3 && z < 12;
    const bool is_inside = is_inner && random.Chance(density);
    const double size = is_even ? 1 : random.Chance(.1) ? 0 : random.Unit();
    return is_inside ? -size - 1e-3 : size;
  };
  return Signs(value_at, first);
}

TEST(SpaceTopology, MarchingCubesOfRandomSignsKeepS1ToS5) {
  const std::uint64_t frames = support::Tries(300u);
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const Signs signs = RandomSigns(seed);
    std::vector<Vec3> positions, normals;
    space::PlaceOnCrossings(signs.bins.bricks, signs.field, signs.crossings, space::kEdgeMargin,
                            positions);
    space::MeshScratch scratch;
    space::EmitMarchingCubes(signs.crossings, scratch.triangles);
    space::NormalsFromTriangles(space::NormalWeights::kArea, positions, scratch.triangles, normals);
    Surface surface;
    space::AssembleSurface(
        {signs.bins.bricks, signs.field, signs.crossings, signs.bodies, positions, normals, {}},
        scratch, surface);
    const absl::Status status = Validate(surface);
    ASSERT_TRUE(status.ok()) << status.message() << ", seed " << seed;
  }
}

struct Moved {
  absl::Status status;         // Of Validate.
  std::uint32_t returned = 0;  // Vertices that were moved back.
  std::size_t dropped = 0;     // Vertices that thinning dropped.
};

// Drops every vertex that the certificate allows to drop.
constexpr double kAnyDistance = 1e9;

/// Moves vertices at random, certifies, drops vertices on edges, and checks the surface. Without
/// the certificate all quads are cut along faces, and no vertex is dropped. `amount` and the
/// distance are in cells.
Moved MoveVertices(const Signs& signs, double amount, double share, Random& random,
                   double thinning_distance, bool is_certified = true, double cell = 1) {
  std::vector<Vec3> anchors, normals;
  const space::BrickDirectory& bricks = signs.bins.bricks;
  space::PlaceOnCrossings(bricks, signs.field, signs.crossings, space::kAnchorMargin, anchors);
  std::vector<std::uint8_t> is_fixed;
  space::MarkFixedVertices(signs.crossings, is_fixed);
  for (Vec3& anchor : anchors) anchor = cell * anchor;
  std::vector<Vec3> positions = anchors;
  const auto move = [&](double part) {
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (is_fixed[v] != 0 || !random.Chance(part)) continue;
      const auto along = [&] { return cell * random.Uniform(-amount, amount); };
      const double x = along(), y = along();
      positions[v] = positions[v] + Vec3{x, y, along()};
    }
  };
  move(share);
  space::Certificate certificate;
  certificate.modes.resize(signs.crossings.cells.size());
  if (is_certified) {
    EXPECT_TRUE(space::Certify(bricks, signs.crossings, cell, anchors, positions, certificate));
    // Rounds look at bricks around moved vertices only: no face has been missed.
    const auto refused = [&] {
      return space::CountRefusedFaces(bricks, signs.crossings, cell, positions, certificate);
    };
    EXPECT_EQ(refused(), 0u);
    move(.02);
    if (amount > 0) {
      EXPECT_GT(refused(), 0u);
    }
    EXPECT_TRUE(
        space::CertifyAgain(bricks, signs.crossings, cell, anchors, positions, certificate));
    EXPECT_EQ(refused(), 0u);
  }
  space::MeshScratch scratch;
  std::vector<space::ThinQuad> thin;
  space::FindThinEdges(bricks, signs.crossings, cell, certificate, positions,
                       cell * thinning_distance, thin);
  space::EmitQuads(bricks, signs.crossings, certificate, thin, scratch.triangles);
  space::NormalsFromTriangles(space::NormalWeights::kArea, positions, scratch.triangles, normals);
  Surface surface;
  space::AssembleSurface(
      {bricks, signs.field, signs.crossings, signs.bodies, positions, normals, thin}, scratch,
      surface);
  const auto dropped = std::count_if(thin.begin(), thin.end(),
                                     [](const space::ThinQuad& quad) { return !quad.IsEmpty(); });
  return {Validate(surface), certificate.returned, static_cast<std::size_t>(dropped)};
}

TEST(Certificate, KeepsMovedVerticesApart) {
  const std::uint64_t frames = support::Tries(8u);
  int intersections = 0;
  std::size_t dropped = 0, dropped_anyhow = 0;
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const Signs signs = RandomSigns(seed);
    Random random(seed);
    // No face is refused at the anchors.
    const Moved anchored = MoveVertices(signs, 0, 1, random, kAnyDistance);
    ASSERT_TRUE(anchored.status.ok()) << anchored.status.message() << ", seed " << seed;
    ASSERT_EQ(anchored.returned, 0u);
    for (const auto& [amount, share] : {std::pair(.3, 1.0), {1.5, .2}, {3.0, .05}}) {
      for (const double distance : {0.0, .1, kAnyDistance}) {
        Random same = random;
        const Moved moved = MoveVertices(signs, amount, share, same, distance);
        ASSERT_TRUE(moved.status.ok()) << moved.status.message() << ", seed " << seed;
        (distance == kAnyDistance ? dropped_anyhow : dropped) += moved.dropped;
        if (distance == 0) {
          ASSERT_EQ(moved.dropped, 0u);
        }
      }
      intersections += !MoveVertices(signs, amount, share, random, 0, false).status.ok();
    }
  }
  // The same vertices do intersect without the certificate.
  EXPECT_GT(intersections, static_cast<int>(frames));
  EXPECT_GT(dropped, 10 * frames);
  EXPECT_GT(dropped_anyhow, 2 * dropped);
}

TEST(Certificate, HoldsForAnyCellAndFarFromTheOrigin) {
  for (const double cell : {1e-60, .37, 1e60}) {
    for (const std::int32_t first : {0, 1 << 20, -(1 << 26)}) {
      SCOPED_TRACE(::testing::Message() << "cell " << cell << ", first brick " << first);
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        Random random(seed);
        const Signs signs = RandomSigns(seed, first);
        const Moved moved = MoveVertices(signs, .3, 1, random, .1, true, cell);
        ASSERT_TRUE(moved.status.ok()) << moved.status.message() << ", seed " << seed;
      }
    }
  }
}

/// The vertices of a slab move by `shift` cells along z, except the fixed vertices of three cells
/// above it. Returns how many of the others the certificate leaves with less than half of `shift`.
int CountLeftBehind(double shift) {
  const Signs signs([](int x, int y, int z) {
    // Two nodes across a diagonal of a face, so that the cell between them has two loops.
    const auto is_at = [&](int a, int b) {
      return z == 8 && ((x == a && y == b) || (x == a + 1 && y == b + 1));
    };
    const bool is_in_slab = x > 2 && x < 13 && y > 2 && y < 13 && z > 3;
    return is_at(7, 7) || is_at(4, 8) || is_at(10, 5) ? -.5 : is_in_slab ? z - 7.9 : 1;
  });
  const space::BrickDirectory& bricks = signs.bins.bricks;
  std::vector<Vec3> anchors;
  space::PlaceOnCrossings(bricks, signs.field, signs.crossings, space::kAnchorMargin, anchors);
  std::vector<std::uint8_t> is_fixed;
  space::MarkFixedVertices(signs.crossings, is_fixed);
  std::vector<Vec3> positions = anchors;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (is_fixed[v] == 0) positions[v].z += shift;
  }
  space::Certificate certificate;
  EXPECT_TRUE(space::Certify(bricks, signs.crossings, 1, anchors, positions, certificate));
  EXPECT_EQ(space::CountRefusedFaces(bricks, signs.crossings, 1, positions, certificate), 0u);
  int left = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    left += is_fixed[v] == 0 && positions[v].z - anchors[v].z < shift / 2;
  }
  std::printf("%d of %zu vertices left behind\n", left, positions.size());
  return left;
}

// If nodes stayed behind vertices that keep their displacement, 56 to 227 of the 770 vertices would
// return.
TEST(Certificate, ReturnsNoPatchesAroundFixedCells) {
  for (const double shift : {.7, .8, .9}) EXPECT_LE(CountLeftBehind(shift), 42);
}

/// The surface of vertices at their anchors, moved along x by `shift(anchor)`.
template <typename Shift>
Surface ThinSurface(const Signs& signs, double thinning_distance, const Shift& shift) {
  const space::BrickDirectory& bricks = signs.bins.bricks;
  std::vector<Vec3> anchors, normals;
  space::PlaceOnCrossings(bricks, signs.field, signs.crossings, space::kAnchorMargin, anchors);
  std::vector<Vec3> positions = anchors;
  for (Vec3& position : positions) position.x += shift(position);
  space::Certificate certificate;
  EXPECT_TRUE(space::Certify(bricks, signs.crossings, 1, anchors, positions, certificate));
  EXPECT_EQ(certificate.returned, 0u);
  std::vector<space::ThinQuad> thin;
  space::FindThinEdges(bricks, signs.crossings, 1, certificate, positions, thinning_distance, thin);
  space::MeshScratch scratch;
  space::EmitQuads(bricks, signs.crossings, certificate, thin, scratch.triangles);
  space::NormalsFromTriangles(space::NormalWeights::kArea, positions, scratch.triangles, normals);
  Surface surface;
  space::AssembleSurface(
      {bricks, signs.field, signs.crossings, signs.bodies, positions, normals, thin}, scratch,
      surface);
  const absl::Status status = Validate(surface);
  EXPECT_TRUE(status.ok()) << status.message();
  return surface;
}

double NoShift(const Vec3&) { return 0; }

TEST(Thinning, LeavesACubeOfOneNode) {
  const Signs signs([](int x, int y, int z) { return x == 7 && y == 8 && z == 7 ? -1.0 : 1.0; });
  const Surface whole = ThinSurface(signs, 0, NoShift);
  EXPECT_EQ(whole.PointCount(), 14u);
  EXPECT_EQ(whole.TriangleCount(), 24u);
  const Surface cube = ThinSurface(signs, kAnyDistance, NoShift);
  EXPECT_EQ(cube.PointCount(), 8u);
  EXPECT_EQ(cube.TriangleCount(), 12u);
  EXPECT_EQ(cube.outer_of, std::vector<std::uint32_t>{kNoShell});
}

TEST(Thinning, FindsTheBodyOfACavityWithoutVerticesOnEdges) {
  const Signs signs([](int x, int y, int z) {
    const auto is_within = [&](int reach) {
      return std::abs(x - 7) <= reach && std::abs(y - 7) <= reach && std::abs(z - 7) <= reach;
    };
    return is_within(2) && !is_within(0) ? -1.0 : 1.0;
  });
  const Surface surface = ThinSurface(signs, kAnyDistance, NoShift);
  ASSERT_EQ(surface.ShellCount(), 2u);
  const int cavity = surface.measures[0].volume < 0 ? 0 : 1;
  EXPECT_EQ(surface.outer_of[cavity], static_cast<std::uint32_t>(1 - cavity));
  EXPECT_EQ(surface.outer_of[1 - cavity], kNoShell);
  EXPECT_EQ(surface.triangle_offsets[cavity + 1] - surface.triangle_offsets[cavity], 12u);
}

TEST(Thinning, KeepsVerticesFartherThanTheDistance) {
  // A slab whose upper side is level at x = 8.5: vertices on edges inside of it can go. Then those
  // in one column of edges rise.
  const Signs signs([](int x, int y, int z) {
    const bool is_inside = x > 5 && x < 9 && y > 3 && y < 12 && z > 3 && z < 12;
    return is_inside ? -1.0 : 1.0;
  });
  const auto rise = [](const Vec3& at) {
    const bool is_raised = at.x == 8.5 && at.y == 8 && (at.z == 6 || at.z == 8 || at.z == 10);
    return is_raised ? .05 : 0;
  };
  const auto points = [&](double distance) {
    const Surface surface = ThinSurface(signs, distance, rise);
    std::size_t raised = 0, level = 0;
    for (std::size_t k = 0; k < surface.PointCount(); ++k) {
      const Vec3 at = Vec3At(surface.points, k);
      const bool is_on_edge = std::round(at.y) == at.y && std::round(at.z) == at.z;
      raised += is_on_edge && at.x == 8.5 + .05;
      level += is_on_edge && at.x == 8.5 && at.y > 4 && at.y < 11 && at.z > 4 && at.z < 11;
    }
    return std::pair(raised, level);
  };
  EXPECT_EQ(points(0), std::pair(std::size_t{3}, std::size_t{33}));
  EXPECT_EQ(points(.04), std::pair(std::size_t{3}, std::size_t{0}));
  EXPECT_EQ(points(.06), std::pair(std::size_t{0}, std::size_t{0}));
}

class SpaceFrames : public ::testing::TestWithParam<SurfacePlacement> {};

TEST_P(SpaceFrames, KeepS1ToS5) {
  const auto plain = SurfaceReconstructor::Create({.placement = GetParam(), .clean = false});
  const auto thin = SurfaceReconstructor::Create(
      {.placement = GetParam(), .clean = false, .thinning_distance = kAnyDistance});
  const auto cleaned = SurfaceReconstructor::Create(
      {.placement = GetParam(), .clean = true, .min_component_particles = 3});
  SurfaceWorkspace workspace;
  Surface surface;
  const std::uint64_t frames = support::Tries(40u);
  std::size_t triangles = 0;
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const SpaceParticles particles = RandomSpaceScene(seed);
    Frame frame = particles.AsFrame();
    const std::vector<float> floats(particles.xyz.begin(), particles.xyz.end());
    if (seed % 4 == 1) frame.positions = std::span<const float>(floats);
    const auto& reconstructor = seed % 3 == 0 ? cleaned : seed % 3 == 1 ? plain : thin;
    ASSERT_TRUE(reconstructor->Reconstruct(frame, workspace, surface).ok());
    const absl::Status status = Validate(surface);
    ASSERT_TRUE(status.ok()) << status.message() << ", seed " << seed;
    triangles += surface.TriangleCount();
  }
  EXPECT_GT(triangles, 400 * frames);
}

TEST_P(SpaceFrames, HaveTheSameBitsForAnyOrderAndHistory) {
  const auto reconstructor = SurfaceReconstructor::Create({.placement = GetParam()});
  Random random(9);
  SurfaceWorkspace warm;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const SpaceParticles particles = RandomSpaceScene(seed);
    SurfaceWorkspace cold;
    Surface expected;
    ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), cold, expected).ok());
    const SpaceParticles shuffled = Shuffled(particles, random);
    Surface surface;
    ASSERT_TRUE(reconstructor->Reconstruct(shuffled.AsFrame(), warm, surface).ok());
    EXPECT_EQ(surface, expected) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(All, SpaceFrames,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST(SurfaceReconstructor, RefusesBadInput) {
  EXPECT_FALSE(SurfaceReconstructor::Create({.spacing = 0}).ok());
  EXPECT_FALSE(SurfaceReconstructor::Create({.kernel_radius = 9}).ok());
  EXPECT_FALSE(SurfaceReconstructor::Create({.cell_size = .1}).ok());
  for (const double distance : {-.01, std::nan(""), HUGE_VAL}) {
    EXPECT_FALSE(SurfaceReconstructor::Create({.thinning_distance = distance}).ok());
  }
  for (const double error : {-.01, 1.01, std::nan(""), HUGE_VAL}) {
    const auto refused = SurfaceReconstructor::Create({.simplify = error});
    const auto violation = FindViolation(refused.status());
    ASSERT_TRUE(violation.has_value()) << error;
    EXPECT_EQ(violation->reason, kReasonOutOfRange);
    EXPECT_EQ(violation->field, "parameters.surface.simplify");
  }
  const auto reconstructor = SurfaceReconstructor::Create({});
  ASSERT_TRUE(reconstructor.ok());
  SurfaceWorkspace workspace;
  Surface surface;
  SpaceParticles particles;
  EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
  EXPECT_EQ(surface, Surface{});
  particles.Add({0, 0, std::nan("")});
  EXPECT_EQ(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).code(),
            absl::StatusCode::kInvalidArgument);
  Frame flat = particles.AsFrame();
  flat.components = 2;
  EXPECT_EQ(reconstructor->Reconstruct(flat, workspace, surface).code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace partiemc
