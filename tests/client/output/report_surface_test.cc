#include "client/output/report_surface.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "absl/strings/escaping.h"
#include "client/output/fixtures.h"
#include "client/output/report.h"
#include "client/output/surface_scene.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

Result SceneResult() {
  Result result;
  result.statistics.particles = 1234;
  result.statistics.spacing = 1;
  return result;
}

struct DecodedSurface {
  wire::ReconstructedFrame frame;
  std::vector<double> particles;
};

/// Reads the format of report_surface.h, written from its description.
DecodedSurface DecodeSurface(const std::string& bytes) {
  std::size_t next = 0;
  const auto count = [&] {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<std::uint8_t>(bytes.at(next++));
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
  };
  const auto difference = [&] {
    const std::uint64_t value = count();
    return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
  };
  DecodedSurface out;
  const std::uint64_t size = count();
  v1::ReconstructedFrame message;
  EXPECT_TRUE(message.ParseFromString(bytes.substr(next, size)));
  EXPECT_TRUE(wire::DecodeResult(message, out.frame).ok());
  next += size;
  double place[4];
  std::memcpy(place, bytes.data() + next, sizeof place);
  next += sizeof place;
  std::int64_t at[3] = {0, 0, 0};
  for (std::uint64_t particles = count(); particles > 0; --particles) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] += difference();
      out.particles.push_back(place[axis] + place[3] * static_cast<double>(at[axis]));
    }
  }
  EXPECT_EQ(next, bytes.size());
  return out;
}

std::string SurfacePage(const ReportOptions& options, int frames) {
  support::TemporaryFolder directory;
  auto report = ReportWriter::Create(directory / "report.html", options);
  EXPECT_TRUE(report.ok()) << report.status();
  const Result result = SceneResult();
  const std::vector<double> particles = {0, 0, 0, 1, 2, 3};
  Summary summary;
  for (int k = 0; k < frames; ++k) {
    const FrameRecord frame = {.index = static_cast<std::uint64_t>(k),
                               .result = result,
                               .surface = &Scene(),
                               .particles_in_space = particles};
    EXPECT_TRUE(report->Add(frame).ok());
    summary.Add(frame);
  }
  EXPECT_TRUE(report->Finish(summary, 2).ok());
  return ReadFile(directory / "report.html");
}

json FrameNumbers(const std::string& page, std::size_t frame) {
  const std::string mark = "class=\"frame-numbers\">";
  std::size_t at = 0;
  for (std::size_t k = 0; k <= frame; ++k) at = page.find(mark, at) + mark.size();
  return json::parse(page.substr(at, page.find("</script>", at) - at));
}

TEST(ReportSurface, HoldsTheSurfaceRoundedAndItsAttributes) {
  const Result result = SceneResult();
  const ReportSurface shown = EncodeReportSurface({.result = result, .surface = &Scene()}, {});
  const DecodedSurface decoded = DecodeSurface(shown.bytes);
  const Surface& surface = decoded.frame.result.surface;
  EXPECT_EQ(shown.triangles, Scene().TriangleCount());
  EXPECT_EQ(surface.point_offsets, Scene().point_offsets);
  EXPECT_EQ(surface.triangle_offsets, Scene().triangle_offsets);
  EXPECT_EQ(surface.outer_of, Scene().outer_of);
  EXPECT_EQ(surface.measures, Scene().measures);
  // The points have another order within their shells.
  const auto sums = [](const Surface& of, std::size_t axis) {
    double sum = 0;
    for (std::size_t k = axis; k < of.points.size(); k += 3) sum += of.points[k];
    return sum / static_cast<double>(of.PointCount());
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sums(surface, axis), sums(Scene(), axis), 1. / 1024);
  }
  ASSERT_EQ(surface.attributes.size(), 2u);
  EXPECT_EQ(surface.attributes[1].name, "a,b");
  EXPECT_LT(static_cast<double>(shown.bytes.size()),
            21 * static_cast<double>(Scene().PointCount()) + 2000);
}

TEST(ReportSurface, SimplifiesALargeSurfaceAndKeepsItsMeasures) {
  const Result result = SceneResult();
  const std::size_t most = Scene().TriangleCount() / 2;
  const ReportSurface shown =
      EncodeReportSurface({.result = result, .surface = &Scene()}, {.max_triangles = most});
  const DecodedSurface decoded = DecodeSurface(shown.bytes);
  EXPECT_GT(shown.triangles, 0u);
  EXPECT_LE(shown.triangles, most);
  EXPECT_EQ(decoded.frame.result.surface.TriangleCount(), shown.triangles);
  EXPECT_EQ(decoded.frame.result.surface.measures, Scene().measures);
}

TEST(ReportSurface, LeavesOutASurfaceThatCannotBeSimplifiedEnough) {
  const Result result = SceneResult();
  for (const std::size_t most : {std::size_t{0}, std::size_t{8}}) {
    const ReportSurface shown =
        EncodeReportSurface({.result = result, .surface = &Scene()}, {.max_triangles = most});
    EXPECT_EQ(shown.triangles, 0u);
    EXPECT_EQ(DecodeSurface(shown.bytes).frame.result.surface.TriangleCount(), 0u);
  }
}

TEST(ReportSurface, SelectsParticlesEvenlyAndRoundsThem) {
  std::vector<double> particles;
  for (int k = 0; k < 1000; ++k) particles.insert(particles.end(), {k * .1, k % 7 * 1., -5. + k});
  particles[3] = std::numeric_limits<double>::quiet_NaN();
  const Result result = SceneResult();
  const auto decoded = [&](std::size_t most) {
    return DecodeSurface(
               EncodeReportSurface(
                   {.result = result, .surface = &Scene(), .particles_in_space = particles},
                   {.max_particles = most})
                   .bytes)
        .particles;
  };
  EXPECT_EQ(decoded(5000).size(), 3 * 999u);
  EXPECT_TRUE(decoded(0).empty());
  const std::vector<double> some = decoded(100);
  ASSERT_EQ(some.size(), 300u);
  std::vector<double> heights;
  for (std::size_t k = 0; k < 100; ++k) heights.push_back(some[3 * k + 2]);
  std::ranges::sort(heights);
  for (std::size_t k = 0; k < 100; ++k) {
    EXPECT_NEAR(heights[k], -5 + 10 * static_cast<double>(k), 1. / 32);
  }
}

TEST(ReportSurface, SurvivesExtremeCoordinates) {
  const Result result = SceneResult();
  Surface wide = Scene();
  wide.points[0] = 1e12;
  const std::vector<double> particles = {-1e308, 0, 0, 1e308, 0, 0};
  const ReportSurface shown = EncodeReportSurface(
      {.result = result, .surface = &wide, .particles_in_space = particles}, {});
  EXPECT_EQ(shown.triangles, 0u);
  EXPECT_EQ(DecodeSurface(shown.bytes).particles.size(), 6u);
}

TEST(ReportSurface, PageHasNumbersAndThePartThatDraws) {
  const std::string page = SurfacePage({}, 2);
  const json numbers = FrameNumbers(page, 1);
  EXPECT_EQ(numbers.at("frame"), 1);
  EXPECT_EQ(numbers.at("particles"), 1234);
  EXPECT_EQ(numbers.at("bodies"), 2);
  EXPECT_EQ(numbers.at("cavities"), 1);
  EXPECT_EQ(numbers.at("genus"), 1);
  EXPECT_EQ(numbers.at("triangles_shown"), Scene().TriangleCount());
  EXPECT_EQ(numbers.at("particles_shown"), 2);
  EXPECT_EQ(numbers.at("has_picture"), true);
  EXPECT_THAT(page, HasSubstr("id=\"space-part\""));
  EXPECT_THAT(page, Not(HasSubstr("{{")));
  EXPECT_LT(SurfacePage({}, 0).size(), 200'000u)
      << "a report without surfaces has no part for them";
}

TEST(ReportSurface, FramesBeyondTheLimitHaveNumbersOnly) {
  const std::string page = SurfacePage({.max_surface_bytes = 200'000}, 6);
  EXPECT_EQ(FrameNumbers(page, 0).at("has_picture"), true);
  EXPECT_EQ(FrameNumbers(page, 5).at("has_picture"), false);
  EXPECT_EQ(FrameNumbers(page, 5).at("genus"), 1);
  EXPECT_LT(page.size(), 200'000u + 430'000u + 6 * 2000u);
}

}  // namespace
}  // namespace partiemc::client
