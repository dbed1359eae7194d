// Pictures of a frame.
#include <cmath>

#include "client/output/color_map.h"
#include "client/output/fixtures.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Svg, UsesTheBoxOfTheSequence) {
  Result result;
  AddRing(result.rings, {0, 0, 1, 0, 0, 1}, kNoRing);
  const std::string svg =
      Encode(FrameFormat::kSvg, {.result = result}, {.picture_box = Box{0, 0, 2, 1}});
  // The longer side, 2, and two margins of 0.04 have 1000 units: 480.769 per unit of length.
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 1000 519.231\""));
  EXPECT_THAT(svg, HasSubstr("d=\"M19.231 500L500 500L19.231 19.231Z\""));
}

TEST(Svg, DrawsADotAtEachContact) {
  const Result result = SquareOnFloor();
  const std::string svg = Encode(FrameFormat::kSvg, {.result = result});
  const std::size_t begin = svg.find("class=\"contacts\"");
  const std::string path = svg.substr(begin, svg.find("/>", begin) - begin);
  EXPECT_EQ(CountOf(path, "h0"), 2u);
  EXPECT_THAT(Encode(FrameFormat::kSvg, {.result = SquareWithHoleAndIsland()}),
              Not(HasSubstr("contacts")));
}

TEST(Svg, EveryMeshEdgeIsDrawnOnce) {
  const Result result = SquareWithHoleAndIsland();
  const std::string svg = Encode(FrameFormat::kSvg, {.result = result});
  const std::size_t begin = svg.find("class=\"mesh\"");
  const std::string path = svg.substr(begin, svg.find("/>", begin) - begin);
  // Square with hole: 8 border edges and 8 across; the island: 3.
  EXPECT_EQ(CountOf(path, "M"), 19u);
}

TEST(Svg, DrawsParticlesOnRequest) {
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {1, 1, 2, 2, 3, std::nan("")};
  const FrameRecord frame{.result = result, .particles = particles};
  EXPECT_EQ(CountOf(Encode(FrameFormat::kSvg, frame), "h0"), 2u);
  EXPECT_EQ(CountOf(Encode(FrameFormat::kSvg, frame, {.picture_particles = false}), "h0"), 0u);
}

// The longer side of the picture is 1000 units.
TEST(Svg, DrawsParticlesByTheirOwnSizes) {
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {1, 1, 2, 2, 3, 3};
  const std::vector<float> sizes = {.5, 1.5, .5};
  FrameRecord frame{.result = result, .particles = particles, .particle_sizes = sizes};
  const std::string dots = Encode(FrameFormat::kSvg, frame);
  EXPECT_EQ(CountOf(dots, R"(class="particles")"), 2u);
  EXPECT_EQ(CountOf(dots, "h0"), 3u);
  frame.are_discs = true;
  const std::string discs = Encode(FrameFormat::kSvg, frame);
  EXPECT_EQ(CountOf(discs, R"(class="grains")"), 2u);
  // Discs have their diameters, dots a share of them.
  const auto width_of = [](const std::string& svg, const char* of) {
    const std::size_t at = svg.rfind(of);
    return std::stod(svg.substr(svg.find("stroke-width=\"", at) + 14));
  };
  const double dot = width_of(dots, "particles\""), disc = width_of(discs, "grains\"");
  EXPECT_NEAR(dot / disc, .4, .01);
}

TEST(Svg, AnEmptyFrameIsAPictureToo) {
  const Result result;
  const std::string svg = Encode(FrameFormat::kSvg, {.result = result});
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(Svg, ColoursByAnAttributeWithALegend) {
  const Result result = WithAttributes();
  const FrameRecord frame{.result = result};
  const std::string plain = Encode(FrameFormat::kSvg, frame);
  EXPECT_EQ(plain.find("class=\"bands\""), std::string::npos);
  const std::string colored = Encode(FrameFormat::kSvg, frame, {.color_by = "height"});
  EXPECT_GT(CountOf(colored, " fill=\"#"), 2 * kColorBands - 2);  // Bands and legend.
  EXPECT_THAT(colored, HasSubstr(">0</text>"));
  EXPECT_THAT(colored, HasSubstr(">4</text>"));
  EXPECT_THAT(colored, HasSubstr(">height</text>"));
  EXPECT_EQ(Encode(FrameFormat::kSvg, frame, {.color_by = "other"}), plain);
}

TEST(Svg, ColoursTheOutlineWithoutAMesh) {
  Result result = WithAttributes();
  result.mesh = {};
  for (AttributeValues& one : result.attributes) {
    one.values.resize(static_cast<std::size_t>(one.components) * result.rings.points.size() / 2);
  }
  const std::string colored = Encode(FrameFormat::kSvg, {.result = result}, {.color_by = "a,b"});
  EXPECT_THAT(colored, HasSubstr("class=\"lines\""));
  EXPECT_THAT(colored, Not(HasSubstr("class=\"bands\"")));
}

}  // namespace
}  // namespace partiemc::client
