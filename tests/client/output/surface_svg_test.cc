// Pictures of surfaces in space.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/output/fixtures.h"
#include "client/output/surface_scene.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The camera looks from x > 0, y < 0, z > 0.
enum Side : std::size_t { kLeft, kRight, kFront, kBack, kBottom, kTop, kSides };

// Adds a cube without normals. Triangles 2 s and 2 s + 1 lie on side s.
void AddCube(Surface& surface, double x, double y, double z, double side) {
  const auto first = static_cast<std::uint32_t>(surface.PointCount());
  for (std::uint32_t k = 0; k < 8; ++k) {
    for (const auto& [origin, bit] : {std::pair(x, k & 1), {y, k >> 1 & 1}, {z, k >> 2 & 1}}) {
      surface.points.push_back(origin + (bit != 0 ? side : 0));
    }
  }
  constexpr std::array<std::array<std::uint32_t, 4>, kSides> kCorners{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& corners : kCorners) {
    for (const std::size_t k : {0, 1, 2, 0, 2, 3}) surface.triangles.push_back(first + corners[k]);
  }
}

Surface Cube() {
  Surface cube;
  AddCube(cube, 0, 0, 0, 1);
  return cube;
}

// A ball of radius 1 with `rows` rows of triangles from pole to pole.
Surface Ball(std::uint32_t rows) {
  Surface ball;
  const auto add = [&ball](double polar, double around) {
    ball.points.insert(ball.points.end(), {std::sin(polar) * std::cos(around),
                                           std::sin(polar) * std::sin(around), std::cos(polar)});
  };
  add(0, 0);
  for (std::uint32_t row = 1; row < rows; ++row) {
    for (std::uint32_t k = 0; k < rows; ++k) {
      add(std::numbers::pi * row / rows, 2 * std::numbers::pi * k / rows);
    }
  }
  add(std::numbers::pi, 0);
  const auto point = [rows](std::uint32_t row, std::uint32_t k) {
    return row == 0 ? 0 : row == rows ? (rows - 1) * rows + 1 : (row - 1) * rows + 1 + k % rows;
  };
  const auto triangle = [&ball](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) ball.triangles.insert(ball.triangles.end(), {a, b, c});
  };
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t k = 0; k < rows; ++k) {
      triangle(point(row, k), point(row + 1, k), point(row + 1, k + 1));
      triangle(point(row, k), point(row + 1, k + 1), point(row, k + 1));
    }
  }
  ball.point_offsets = {0, static_cast<std::uint32_t>(ball.PointCount())};
  ball.triangle_offsets = {0, static_cast<std::uint32_t>(ball.TriangleCount())};
  ball.outer_of = {kNoShell};
  ball.measures.resize(1);
  return ball;
}

std::string Svg(const Surface& surface, const FrameWriterOptions& options = {}) {
  Result result;
  result.statistics.spacing = 0.05;
  return Encode(FrameFormat::kSvg, {.index = 3, .time = .5, .result = result, .surface = &surface},
                options);
}

struct Facet {
  std::string color, path;
};

// The triangles of a picture with their colours, in the order in which they are drawn.
std::vector<Facet> FacetsOf(std::string_view svg) {
  const auto between = [&svg](std::string_view begin, std::string_view end) {
    const std::size_t from = svg.find(begin);
    if (from == std::string_view::npos) return std::string();
    svg.remove_prefix(from + begin.size());
    std::string text(svg.substr(0, svg.find(end)));
    svg.remove_prefix(text.size());
    return text;
  };
  std::map<std::string, std::string> colors;
  const std::string_view style = svg.substr(0, svg.find("</style>"));
  for (std::size_t at = style.find(".t"); at != std::string_view::npos;
       at = style.find(".t", at + 1)) {
    const std::size_t brace = style.find('{', at);
    colors[std::string(style.substr(at + 1, brace - at - 1))] = style.substr(brace + 6, 7);
  }
  std::vector<Facet> facets;
  for (;;) {
    const std::string name = between("<path class=\"", "\"");
    if (name.empty()) return facets;
    facets.push_back({colors.at(name), between(" d=\"", "\"")});
  }
}

struct FacetNumbers {
  double width = 0, lowest_y = 0;
};

FacetNumbers NumbersOf(const Facet& facet) {
  double x = 0, y = 0, left = 1e9, right = -1e9, lowest = -1e9;
  std::string numbers = facet.path;
  std::ranges::replace_if(
      numbers, [](char c) { return c == 'M' || c == 'L' || c == 'Z'; }, ' ');
  std::istringstream in(numbers);
  while (in >> x >> y) {
    left = std::min(left, x);
    right = std::max(right, x);
    lowest = std::max(lowest, y);
  }
  return {right - left, lowest};
}

int RedOf(const Facet& facet) { return std::stoi(facet.color.substr(1, 2), nullptr, 16); }

TEST(SurfaceSvg, ShowsTheThreeSidesThatFaceTheCamera) {
  const std::string svg = Svg(Cube());
  EXPECT_THAT(svg, HasSubstr("<title>Frame 3, time 0.5</title>"));
  const std::vector<Facet> facets = FacetsOf(svg);
  ASSERT_EQ(facets.size(), 6u);
  // Two triangles of a side have the same colour; the top is the brightest.
  std::map<std::string, int> colors;
  for (const Facet& facet : facets) ++colors[facet.color];
  EXPECT_EQ(colors.size(), 3u);
  for (const auto& [color, count] : colors) EXPECT_EQ(count, 2) << color;
  Surface turned = Cube();
  std::ranges::reverse(turned.triangles);  // Inside out: the other three sides.
  const std::vector<Facet> others = FacetsOf(Svg(turned));
  ASSERT_EQ(others.size(), 6u);
  for (const Facet& facet : others) {
    EXPECT_TRUE(std::ranges::none_of(facets, [&](auto& one) { return one.path == facet.path; }));
  }
}

TEST(SurfaceSvg, ANearBodyCoversAFarOne) {
  for (const bool near_first : {false, true}) {
    Surface surface;
    if (near_first) AddCube(surface, 3, -5, 3, 1);
    AddCube(surface, 0, 0, 0, 2);
    if (!near_first) AddCube(surface, 3, -5, 3, 1);
    const std::vector<Facet> facets = FacetsOf(Svg(surface));
    ASSERT_EQ(facets.size(), 12u);
    // The smaller cube is drawn last: its triangles are narrower.
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_GT(NumbersOf(facets[k]).width, NumbersOf(facets[k + 6]).width);
    }
  }
}

TEST(SurfaceSvg, TheTopIsTheBrightestSideOfACube) {
  // The cube's upper corners, and none of its lower ones, lie on the top; y points down.
  std::vector<Facet> facets = FacetsOf(Svg(Cube()));
  ASSERT_EQ(facets.size(), 6u);
  std::ranges::sort(facets, {}, [](const Facet& facet) { return NumbersOf(facet).lowest_y; });
  EXPECT_GT(RedOf(facets[0]), RedOf(facets[2]));
  EXPECT_EQ(RedOf(facets[0]), RedOf(facets[1]));
  EXPECT_GT(RedOf(facets[0]), RedOf(facets[5]));
}

TEST(SurfaceSvg, NormalsLightTheSurfaceButNotItsCutFaces) {
  Surface cube = Cube();
  const std::vector<Facet> flat = FacetsOf(Svg(cube));
  for (std::size_t k = 0; k < cube.PointCount(); ++k) {
    cube.normals.insert(cube.normals.end(), {0, 0, 1});
  }
  const auto colors = [&cube] {
    std::set<std::string> different;
    for (const Facet& facet : FacetsOf(Svg(cube))) different.insert(facet.color);
    return different;
  };
  EXPECT_EQ(colors().size(), 1u);
  for (std::uint32_t k = 0; k < cube.TriangleCount(); ++k) cube.cuts.push_back(k);
  EXPECT_EQ(colors().size(), 3u);
  EXPECT_EQ(FacetsOf(Svg(cube)).front().color, flat.front().color);
}

TEST(SurfaceSvg, SizeAndPlaceOfTheBodyDoNotMatter) {
  const auto paths = [](const Surface& surface) {
    std::vector<std::string> all;
    for (const Facet& facet : FacetsOf(Svg(surface))) all.push_back(facet.path);
    return all;
  };
  const std::vector<std::string> usual = paths(Cube());
  for (const double side : {1e-200, 1e200, 1e308}) {
    Surface cube;
    AddCube(cube, 0, 0, 0, side);
    EXPECT_EQ(paths(cube), usual) << side;
  }
}

TEST(SurfaceSvg, ColoursByAnAttributeWithALegend) {
  Surface cube = Cube();
  cube.attributes = {{.name = "height", .components = 1, .values = {}},
                     {.name = "flow", .components = 3, .values = {}}};
  for (std::size_t k = 0; k < 8; ++k) {
    cube.attributes[0].values.push_back(static_cast<float>(cube.points[3 * k + 2]));
    for (const float value : {0.f, 3.f, 4.f}) {
      cube.attributes[1].values.push_back(value * static_cast<float>(cube.points[3 * k]));
    }
  }
  const std::string plain = Svg(cube);
  EXPECT_EQ(plain, Svg(Cube()));
  EXPECT_EQ(plain, Svg(cube, {.color_by = "other"}));
  const std::string colored = Svg(cube, {.color_by = "height"});
  EXPECT_THAT(colored, HasSubstr(">height</text>"));
  EXPECT_THAT(colored, HasSubstr(">1</text>"));
  EXPECT_EQ(FacetsOf(colored).size(), 6u);
  EXPECT_NE(FacetsOf(colored).front().color, FacetsOf(plain).front().color);
  EXPECT_THAT(Svg(cube, {.color_by = "flow"}), HasSubstr(">5</text>")) << "the length";
}

TEST(SurfaceSvg, CavitiesAreNotDrawn) {
  const Surface scene = HollowBallAndTorus();
  Surface filled = scene;
  for (std::size_t shell = scene.ShellCount(); shell-- > 0;) {
    if (scene.outer_of[shell] == kNoShell) continue;
    filled.triangles.erase(filled.triangles.begin() + 3 * scene.triangle_offsets[shell],
                           filled.triangles.begin() + 3 * scene.triangle_offsets[shell + 1]);
  }
  ASSERT_LT(filled.triangles.size(), scene.triangles.size());
  filled.outer_of.clear();
  EXPECT_EQ(Svg(filled), Svg(scene));
}

TEST(SurfaceSvg, ALargeSurfaceIsSimplified) {
  const Surface ball = Ball(150);
  ASSERT_GT(ball.TriangleCount(), 40'000u);
  const std::vector<Facet> facets = FacetsOf(Svg(ball));
  EXPECT_GT(facets.size(), 1'000u);
  EXPECT_LE(facets.size(), 11'000u);
}

TEST(SurfaceSvg, AnEmptySurfaceIsAPictureToo) {
  const std::string svg = Svg({});
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace partiemc::client
