// Levels of detail of surfaces in messages: exact, relative and compact.
#include "wire/surface_level.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/surface_reconstructor.h"
#include "support/shell_measures.h"
#include "wire/codec.h"

namespace partiemc::wire {
namespace {

LevelOfDetail MaxError(double error) { return {.max_error = error, .max_triangles = {}}; }
LevelOfDetail MaxTriangles(std::uint64_t n) { return {.max_error = {}, .max_triangles = n}; }

// A shaken ball with a hollow, spray around it, and two attributes. Far from the origin.
Result Scene(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shake(-.25, .25), place(-22, 22);
  std::vector<double> positions;
  std::vector<float> places, numbers;
  const auto add = [&](const std::array<double, 3>& at) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      positions.push_back(100 * static_cast<double>(axis) + .5 * at[axis]);
      places.push_back(static_cast<float>(at[axis]));
    }
    numbers.push_back(static_cast<float>(numbers.size() % 7));
  };
  for (int x = -11; x <= 11; ++x) {
    for (int y = -11; y <= 11; ++y) {
      for (int z = -11; z <= 11; ++z) {
        const int squares = x * x + y * y + z * z;
        if (squares > 121 || squares < 25) continue;
        add({x + shake(random), y + shake(random), z + shake(random)});
      }
    }
  }
  for (int k = 0; k < 40; ++k) add({place(random), place(random), place(random)});
  const Attribute attributes[] = {{.name = "place", .components = 3, .values = places},
                                  {.name = "number", .components = 1, .values = numbers}};
  const Frame frame{
      .positions = std::span<const double>(positions), .components = 3, .attributes = attributes};
  ReconstructionParameters parameters;
  parameters.output = Output::kSurface;
  parameters.placement = Placement::kVirtualPlane;
  parameters.spacing = .5;
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result result;
  EXPECT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
  return result;
}

absl::Status Grant(std::uint64_t) { return absl::OkStatus(); }

Surface Decoded(const v1::ReconstructedFrame& message) {
  ReconstructedFrame frame;
  EXPECT_TRUE(DecodeResult(message, frame).ok());
  return frame.result.surface;
}

class Levels : public ::testing::TestWithParam<Coordinates> {
 protected:
  v1::ReconstructedFrame MessageOf(const Result& result, bool normals = true) const {
    v1::ReconstructedFrame message;
    EXPECT_TRUE(
        EncodeResult(result, {}, {.normals = normals, .coordinates = GetParam()}, message).ok());
    return message;
  }
};
INSTANTIATE_TEST_SUITE_P(Coordinates, Levels,
                         ::testing::Values(Coordinates::kFloat64, Coordinates::kRelativeFloat32,
                                           Coordinates::kCompact));

// The bits of coordinates and attributes of each point.
std::set<std::vector<double>> PointsOf(const Surface& surface) {
  std::set<std::vector<double>> points;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    std::vector<double> values(surface.points.begin() + static_cast<std::ptrdiff_t>(3 * k),
                               surface.points.begin() + static_cast<std::ptrdiff_t>(3 * k + 3));
    for (const AttributeValues& attribute : surface.attributes) {
      for (int c = 0; c < attribute.components; ++c) {
        values.push_back(attribute.values[static_cast<std::size_t>(attribute.components) * k +
                                          static_cast<std::size_t>(c)]);
      }
    }
    points.insert(std::move(values));
  }
  return points;
}

TEST_P(Levels, WithoutARemovedPointHaveTheDigestOfTheirMessage) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    v1::ReconstructedFrame message = MessageOf(Scene(seed));
    ASSERT_TRUE(
        ReplaceByLevel(MaxError(1e-9), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
    const auto level = LevelOf(message);
    ASSERT_TRUE(level.has_value());
    EXPECT_EQ(level->digest, DigestSurface(Decoded(message))) << level->error;
  }
}

TEST_P(Levels, HavePointsOfTheExactSurfaceAndFewerTriangles) {
  const Result result = Scene(1);
  const v1::ReconstructedFrame exact = MessageOf(result);
  const Surface all = Decoded(exact);
  const auto points = PointsOf(all);
  std::size_t former = all.TriangleCount();
  for (const double error : {.02, .1, .3}) {
    SCOPED_TRACE(error);
    v1::ReconstructedFrame message = exact;
    ASSERT_TRUE(
        ReplaceByLevel(MaxError(error), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
    EXPECT_EQ(message.coordinate_format(), exact.coordinate_format());
    EXPECT_EQ(message.surface().step(), exact.surface().step());
    EXPECT_EQ(message.surface_digest(), exact.surface_digest());
    EXPECT_EQ(message.statistics().triangles(), all.TriangleCount());
    Surface level = Decoded(message);
    std::printf("error %g: %zu of %zu triangles, %zu of %zu bytes\n", error, level.TriangleCount(),
                all.TriangleCount(), message.ByteSizeLong(), exact.ByteSizeLong());
    EXPECT_LT(level.TriangleCount(), former);
    former = level.TriangleCount();
    EXPECT_LT(message.ByteSizeLong(), exact.ByteSizeLong());
    EXPECT_EQ(level.normals.size(), 3 * level.PointCount());
    EXPECT_EQ(level.measures, all.measures);
    EXPECT_EQ(level.outer_of, all.outer_of);
    const auto mark = LevelOf(message);
    ASSERT_TRUE(mark.has_value());
    EXPECT_EQ(mark->error, error);
    EXPECT_EQ(mark->digest, DigestSurface(level));
    const auto left = PointsOf(level);
    EXPECT_TRUE(std::includes(points.begin(), points.end(), left.begin(), left.end()));
    support::MeasureShells(level);
    const absl::Status valid = Validate(level);
    EXPECT_TRUE(valid.ok()) << valid;
  }
  EXPECT_LT(3 * former, all.TriangleCount());
}

TEST_P(Levels, AreTheSameForAnyNumberOfThreads) {
  const v1::ReconstructedFrame exact = MessageOf(Scene(2), false);
  std::string first;
  for (const unsigned threads : {1u, 2u}) {
    v1::ReconstructedFrame message = exact;
    Arena arena(threads);
    arena.Execute([&] {
      ASSERT_TRUE(
          ReplaceByLevel(MaxError(.1), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
    });
    EXPECT_TRUE(message.surface().normals().empty());
    const std::string bytes = message.SerializeAsString();
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
}

TEST_P(Levels, OfANumberOfTrianglesHaveTheSmallestErrorThatSuffices) {
  const v1::ReconstructedFrame exact = MessageOf(Scene(3));
  const std::uint64_t all = Decoded(exact).TriangleCount();
  double former = 0;
  for (const std::uint64_t most : {all, all * 3 / 4, all / 2, all / 3}) {
    v1::ReconstructedFrame message = exact;
    ASSERT_TRUE(
        ReplaceByLevel(MaxTriangles(most), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
    const double error = LevelOf(message)->error;
    const std::uint64_t left = Decoded(message).TriangleCount();
    std::printf("at most %zu: %zu, error %g\n", static_cast<std::size_t>(most),
                static_cast<std::size_t>(left), error);
    EXPECT_LE(left, most);
    EXPECT_GE(error, former);
    former = error;
    if (most == all) {
      EXPECT_EQ(error, 0);
      continue;
    }
    EXPECT_GT(2 * left, most) << "a smaller error would suffice";
    v1::ReconstructedFrame by_error = exact;
    ASSERT_TRUE(
        ReplaceByLevel(MaxError(error), SurfaceOrigin::kUnknown, Grant, nullptr, by_error).ok());
    EXPECT_EQ(by_error.SerializeAsString(), message.SerializeAsString());
  }
  v1::ReconstructedFrame message = exact;
  ASSERT_TRUE(
      ReplaceByLevel(MaxTriangles(1), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
  EXPECT_EQ(LevelOf(message)->error, .35);
  EXPECT_LT(3 * Decoded(message).TriangleCount(), all);
}

TEST(Level, OfAMessageWithoutASurfaceIsThisMessage) {
  v1::ReconstructedFrame message;
  message.set_sequence(7);
  ASSERT_TRUE(ReplaceByLevel(MaxError(.1), SurfaceOrigin::kUnknown, Grant, nullptr, message).ok());
  EXPECT_FALSE(message.has_surface());
  EXPECT_FALSE(LevelOf(message).has_value());
}

TEST(Level, IsRefusedWithItsField) {
  const auto field = [](const v1::LevelOfDetail& message) {
    const auto level = DecodeLevelOfDetail(message);
    return level.ok() ? std::string() : FindViolation(level.status())->field;
  };
  v1::LevelOfDetail message;
  EXPECT_EQ(field(message), "open.level_of_detail");
  for (const double wrong :
       {0.0, -.1, 1.5, std::nan(""), std::numeric_limits<double>::infinity()}) {
    message.set_max_error(wrong);
    EXPECT_EQ(field(message), "open.level_of_detail.max_error") << wrong;
  }
  message.set_max_triangles(0);
  EXPECT_EQ(field(message), "open.level_of_detail.max_triangles");
  message.set_max_triangles(1);
  EXPECT_EQ(field(message), "");
}

TEST(Level, WithoutMemoryOrCancelledIsAnError) {
  v1::ReconstructedFrame exact;
  ASSERT_TRUE(EncodeResult(Scene(4), {}, {}, exact).ok());
  std::uint64_t asked = 0;
  const auto refuse = [&](std::uint64_t bytes) {
    asked = bytes;
    return absl::ResourceExhaustedError("memory");
  };
  v1::ReconstructedFrame message = exact;
  EXPECT_TRUE(absl::IsResourceExhausted(
      ReplaceByLevel(MaxError(.1), SurfaceOrigin::kUnknown, refuse, nullptr, message)));
  EXPECT_GT(asked, 2 * exact.ByteSizeLong());
  const std::atomic<bool> cancelled = true;
  EXPECT_TRUE(absl::IsCancelled(
      ReplaceByLevel(MaxError(.1), SurfaceOrigin::kUnknown, Grant, &cancelled, message)));
}

TEST(Level, OfAMalformedSurfaceIsDataLoss) {
  v1::ReconstructedFrame message;
  ASSERT_TRUE(EncodeResult(Scene(4), {}, {}, message).ok());
  message.mutable_surface()->mutable_points()->resize(24);
  EXPECT_TRUE(absl::IsDataLoss(
      ReplaceByLevel(MaxError(.1), SurfaceOrigin::kUnknown, Grant, nullptr, message)));
}

// A tetrahedron at `at`.
void AddTetrahedron(double at, Surface& surface) {
  const auto first = static_cast<std::uint32_t>(surface.PointCount());
  surface.points.insert(surface.points.end(), {at, 0, 0, at + 1, 0, 0, at, 1, 0, at, 0, 1});
  for (const std::uint32_t corner : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) {
    surface.triangles.push_back(first + corner);
  }
}
void EndShell(Surface& surface) {
  surface.point_offsets.push_back(static_cast<std::uint32_t>(surface.PointCount()));
  surface.triangle_offsets.push_back(static_cast<std::uint32_t>(surface.TriangleCount()));
  surface.outer_of.push_back(kNoShell);
  surface.measures.emplace_back();
}
// Why there is no level.
std::string FaultOf(Surface surface, double spacing = 1) {
  const absl::Status status =
      MakeLevel(MaxError(.1), spacing, SurfaceOrigin::kUnknown, nullptr, surface).status();
  EXPECT_TRUE(status.ok() || absl::IsDataLoss(status)) << status;
  return std::string(status.message());
}

TEST(Level, OfASurfaceThatIsNotManifoldIsRefused) {
  Surface good;
  AddTetrahedron(0, good);
  EndShell(good);
  EXPECT_EQ(FaultOf(good), "");
  Surface open = good, twice = good, unused = good, two = good;
  open.triangles.resize(9), open.triangle_offsets[1] = 3;
  EXPECT_EQ(FaultOf(open), "surface: shell 0 is not closed, or not manifold");
  std::copy_n(twice.triangles.begin(), 3, twice.triangles.begin() + 3);
  EXPECT_EQ(FaultOf(twice), "surface: shell 0 is not closed, or not manifold");
  unused.points.insert(unused.points.end(), {5, 5, 5}), unused.point_offsets[1] = 5;
  EXPECT_EQ(FaultOf(unused), "surface: shell 0 is not connected");
  AddTetrahedron(3, two);
  two.point_offsets[1] = 8, two.triangle_offsets[1] = 8;
  EXPECT_EQ(FaultOf(two), "surface: shell 0 is not connected");
}

TEST(Level, OfCoordinatesWithoutAMeaningIsRefused) {
  Surface surface;
  AddTetrahedron(0, surface);
  EndShell(surface);
  for (const double spacing : {0.0, -1.0, std::nan(""), HUGE_VAL, 1e-300, 1e-13}) {
    EXPECT_NE(FaultOf(surface, spacing), "") << spacing;
  }
  for (const double coordinate : {std::nan(""), HUGE_VAL, -1e200, 1e-200, 1e13}) {
    surface.points[4] = coordinate;
    EXPECT_NE(FaultOf(surface), "") << coordinate;
  }
}

// Closed, but no surface of particles: its simplification or its check would take hours.
TEST(Level, OfASurfaceThatTakesTooMuchWorkIsRefused) {
  Surface pile;  // All pairs of shells touch.
  for (int k = 0; k < 40'000; ++k) {
    AddTetrahedron(1e-9 * k, pile);
    EndShell(pile);
  }
  EXPECT_EQ(FaultOf(pile), "surface: too many triangles are large or overlap");
  Surface dolls;  // Each shell contains all smaller ones.
  for (int k = 0; k < 40'000; ++k) {
    const double size = 1 + 1e-4 * k;
    AddTetrahedron(0, dolls);
    for (std::size_t i = dolls.points.size() - 12; i < dolls.points.size(); ++i) {
      dolls.points[i] = size * (dolls.points[i] - .25);
    }
    EndShell(dolls);
  }
  EXPECT_EQ(FaultOf(dolls), "surface: too many triangles are large or overlap");
  Surface fan;  // Two points have all triangles.
  constexpr std::uint32_t kCorners = 100'000;
  fan.points = {0, 0, 1, 0, 0, -1};
  for (std::uint32_t k = 0; k < kCorners; ++k) {
    const double turn = 2 * 3.141592653589793 * k / kCorners;
    fan.points.insert(fan.points.end(), {100 * std::cos(turn), 100 * std::sin(turn), 0});
    const std::uint32_t a = 2 + k, b = 2 + (k + 1) % kCorners;
    fan.triangles.insert(fan.triangles.end(), {0, a, b, 1, b, a});
  }
  EndShell(fan);
  EXPECT_EQ(FaultOf(fan), "surface: too many triangles at a point");
  Surface row;  // Many shells in a row, apart from each other.
  for (int k = 0; k < 40'000; ++k) {
    AddTetrahedron(3.0 * k, row);
    EndShell(row);
  }
  EXPECT_EQ(FaultOf(row), "");
  Surface large;  // Triangles of a million spacings.
  for (int k = 0; k < 1000; ++k) {
    AddTetrahedron(2 * k, large);
    for (std::size_t i = large.points.size() - 12; i < large.points.size(); ++i) {
      large.points[i] *= 1e6;
    }
    EndShell(large);
  }
  EXPECT_EQ(FaultOf(large), "");
}

TEST(Level, OfShellsWhosePointsCoincideKeepsThem) {
  Surface surface;
  for (int k = 0; k < 2; ++k) {
    AddTetrahedron(0, surface);
    EndShell(surface);
  }
  std::fill(surface.points.begin(), surface.points.end(), 1.0);
  EXPECT_EQ(FaultOf(surface), "");
}

// Fluid in a corner of two walls, whose cut faces have long triangles.
TEST(Level, OfALongFilamentInACornerIsMade) {
  std::vector<double> positions;
  for (int x = 0; x < 2000; ++x) {
    for (int k = 0; k < 9; ++k) positions.insert(positions.end(), {x + .5, k % 3 + .5, k / 3 + .5});
  }
  const auto reconstructor =
      SurfaceReconstructor::Create({.wall_planes = {{.axis = 1}, {.axis = 2}}});
  SurfaceWorkspace workspace;
  Surface surface;
  const Frame frame{.positions = std::span<const double>(positions), .components = 3};
  ASSERT_TRUE(reconstructor->Reconstruct(frame, workspace, surface).ok());
  EXPECT_EQ(FaultOf(surface), "");
}

// Self-intersections stay, because rounding can make them.
TEST(Level, OfASurfaceThatIntersectsItselfKeepsItsTrianglesThere) {
  v1::ReconstructedFrame message;
  ASSERT_TRUE(EncodeResult(Scene(5), {}, {}, message).ok());
  Surface surface = Decoded(message);
  const std::size_t all = surface.TriangleCount();
  const std::uint32_t moved = surface.triangles[0], onto = surface.triangles[1];
  std::copy_n(surface.points.begin() + 3 * onto, 3, surface.points.begin() + 3 * moved);
  EXPECT_FALSE(Validate(surface).ok()) << "two triangles are degenerate";
  const auto made = MakeLevel(MaxError(.1), .5, SurfaceOrigin::kUnknown, nullptr, surface);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_LT(2 * surface.TriangleCount(), all);
  surface.points[0] += 3;
  EXPECT_FALSE(Validate(surface).ok());
  EXPECT_TRUE(MakeLevel(MaxError(.3), .5, SurfaceOrigin::kUnknown, nullptr, surface).ok());
}

}  // namespace
}  // namespace partiemc::wire
