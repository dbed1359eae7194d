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

TEST_P(Levels, HavePointsOfTheExactSurfaceAndFewerTriangles) {
  const Result result = Scene(1);
  const v1::ReconstructedFrame exact = MessageOf(result);
  const Surface all = Decoded(exact);
  const auto points = PointsOf(all);
  std::size_t former = all.TriangleCount();
  for (const double error : {.02, .1, .3}) {
    SCOPED_TRACE(error);
    v1::ReconstructedFrame message = exact;
    ASSERT_TRUE(ReplaceByLevel(MaxError(error), Grant, nullptr, message).ok());
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
    arena.Execute([&] { ASSERT_TRUE(ReplaceByLevel(MaxError(.1), Grant, nullptr, message).ok()); });
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
    ASSERT_TRUE(ReplaceByLevel(MaxTriangles(most), Grant, nullptr, message).ok());
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
    ASSERT_TRUE(ReplaceByLevel(MaxError(error), Grant, nullptr, by_error).ok());
    EXPECT_EQ(by_error.SerializeAsString(), message.SerializeAsString());
  }
  v1::ReconstructedFrame message = exact;
  ASSERT_TRUE(ReplaceByLevel(MaxTriangles(1), Grant, nullptr, message).ok());
  EXPECT_EQ(LevelOf(message)->error, .35);
  EXPECT_LT(3 * Decoded(message).TriangleCount(), all);
}

TEST(Level, OfAMessageWithoutASurfaceIsThisMessage) {
  v1::ReconstructedFrame message;
  message.set_sequence(7);
  ASSERT_TRUE(ReplaceByLevel(MaxError(.1), Grant, nullptr, message).ok());
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
  EXPECT_TRUE(absl::IsResourceExhausted(ReplaceByLevel(MaxError(.1), refuse, nullptr, message)));
  EXPECT_GT(asked, 2 * exact.ByteSizeLong());
  const std::atomic<bool> cancelled = true;
  EXPECT_TRUE(absl::IsCancelled(ReplaceByLevel(MaxError(.1), Grant, &cancelled, message)));
}

TEST(Level, OfAMalformedSurfaceIsDataLoss) {
  v1::ReconstructedFrame message;
  ASSERT_TRUE(EncodeResult(Scene(4), {}, {}, message).ok());
  message.mutable_surface()->mutable_points()->resize(24);
  EXPECT_TRUE(absl::IsDataLoss(ReplaceByLevel(MaxError(.1), Grant, nullptr, message)));
}

}  // namespace
}  // namespace partiemc::wire
