// Files of surfaces in space, read back.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "client/output/fixtures.h"
#include "client/output/frame_writer.h"
#include "client/output/read_files.h"
#include "client/output/surface_scene.h"
#include "client/output/text.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"
#include "partiemc/surface_state.h"

namespace partiemc::client {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

const Result kNoOutline;

std::string Encode(FrameFormat format, const Surface& surface,
                   const FrameWriterOptions& options = {}) {
  auto bytes = EncodeFrame(
      format, {.index = 3, .time = 0.5, .result = kNoOutline, .surface = &surface}, options);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.value_or("");
}

struct Triangles {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;
};

double Volume(const Triangles& mesh) {
  double sum = 0;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    std::array<const double*, 3> p;
    for (std::size_t c = 0; c < 3; ++c) {
      p[c] = &mesh.points[std::size_t{3} * mesh.triangles[k + c]];
    }
    sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
           p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
           p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return sum / 6;
}

// Each side belongs to two triangles, which run along it in opposite directions.
bool IsWatertight(const Triangles& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    const std::size_t next = k % 3 == 2 ? k - 2 : k + 1;
    if (!sides.insert({mesh.triangles[k], mesh.triangles[next]}).second) return false;
  }
  return std::ranges::all_of(sides, [&](const auto& side) {
    return sides.contains({side.second, side.first});
  });
}

double TrueVolume(const Surface& surface) {
  double volume = 0;
  for (const ShellMeasures& measures : surface.measures) volume += measures.volume;
  return volume;
}

void ExpectTheSurface(const Triangles& mesh, const Surface& surface, double tolerance) {
  EXPECT_EQ(mesh.points.size(), surface.points.size());
  EXPECT_EQ(mesh.triangles.size(), surface.triangles.size());
  EXPECT_TRUE(IsWatertight(mesh));
  EXPECT_NEAR(Volume(mesh) / TrueVolume(surface), 1, tolerance);
}

template <typename T>
std::vector<T> ValuesOf(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

template <typename T>
T Next(const std::string& bytes, std::size_t& at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  at += sizeof(T);
  return value;
}

double Parsed(const std::string& word) {
  double value = 0;
  std::from_chars(word.data(), word.data() + word.size(), value);
  return value;
}

TEST(SurfaceFiles, TheSceneHasACavityAndAHandle) {
  ASSERT_TRUE(Validate(Scene()).ok());
  ASSERT_EQ(Scene().ShellCount(), 3u);
  EXPECT_EQ(std::ranges::count(Scene().outer_of, kNoShell), 2);
  const SurfaceTotals totals = TotalsOf(Scene());
  EXPECT_EQ(totals.genus, 1);
  EXPECT_NEAR(totals.volume, TrueVolume(Scene()), 1e-9);
}

// The columns of a PLY as numbers, by name, and its triangles.
std::map<std::string, std::vector<double>> ReadPly(const std::string& ply,
                                                   std::vector<std::uint32_t>& triangles) {
  std::istringstream header(ply.substr(0, ply.find("end_header\n")));
  std::vector<std::pair<std::string, std::string>> properties;  // Type and name.
  std::map<std::string, std::size_t> counts;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word, type, name;
    words >> word >> type >> name;
    if (word == "element") counts[type] = std::stoul(name);
    if (word == "property" && type != "list") properties.emplace_back(type, name);
  }
  std::map<std::string, std::vector<double>> columns;
  std::size_t at = ply.find("end_header\n") + 11;
  for (std::size_t k = 0; k < counts["vertex"]; ++k) {
    for (const auto& [type, name] : properties) {
      columns[name].push_back(type == "double"  ? Next<double>(ply, at)
                              : type == "float" ? static_cast<double>(Next<float>(ply, at))
                                                : Next<std::int32_t>(ply, at));
    }
  }
  for (std::size_t k = 0; k < counts["face"]; ++k) {
    EXPECT_EQ(Next<std::uint8_t>(ply, at), 3);
    for (int c = 0; c < 3; ++c) triangles.push_back(Next<std::uint32_t>(ply, at));
  }
  EXPECT_EQ(at, ply.size());
  return columns;
}

TEST(SurfaceFiles, PlyHasNormalsShellsAndAttributes) {
  Surface surface = Scene();
  surface.attributes.push_back({"nx", 1, surface.attributes[0].values});
  std::vector<std::uint32_t> triangles;
  const auto columns = ReadPly(Encode(FrameFormat::kPly, surface), triangles);
  EXPECT_EQ(triangles, surface.triangles);
  Triangles mesh{.triangles = triangles};
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    for (const char* name : {"x", "y", "z"}) mesh.points.push_back(columns.at(name)[k]);
  }
  EXPECT_EQ(mesh.points, surface.points);
  ExpectTheSurface(mesh, surface, 1e-9);
  std::uint32_t shell = 0;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    if (k == surface.point_offsets[shell + 1]) ++shell;
    ASSERT_EQ(columns.at("shell")[k], shell);
    ASSERT_EQ(columns.at("nx")[k], surface.normals[3 * k]);
    ASSERT_EQ(columns.at("nz")[k], surface.normals[3 * k + 2]);
    ASSERT_EQ(columns.at("height")[k], surface.attributes[0].values[k]);
    ASSERT_EQ(columns.at("a_b_2")[k], surface.attributes[1].values[3 * k + 2]);
    ASSERT_EQ(columns.at("nx_")[k], surface.attributes[0].values[k]);
  }
}

TEST(SurfaceFiles, ObjHasAGroupForEachBody) {
  const Surface& surface = Scene();
  std::vector<double> points;
  std::vector<float> normals;
  std::map<std::string, Triangles> groups;
  std::string group;
  for (const auto& words : ObjLines(Encode(FrameFormat::kObj, surface))) {
    if (words[0] == "g") group = words.at(1);
    for (std::size_t k = 1; k < words.size(); ++k) {
      if (words[0] == "v") points.push_back(Parsed(words[k]));
      if (words[0] == "vn") normals.push_back(static_cast<float>(Parsed(words[k])));
      if (words[0] != "f") continue;
      const auto number = static_cast<std::uint32_t>(Parsed(words[k]));
      EXPECT_EQ(words[k], std::to_string(number) + "//" + std::to_string(number));
      groups[group].triangles.push_back(number - 1);
    }
  }
  EXPECT_EQ(points, surface.points);
  EXPECT_EQ(normals, surface.normals);
  ASSERT_EQ(groups.size(), 2u);
  double volume = 0;
  for (std::size_t shell = 0, body = 0; shell < surface.ShellCount(); ++shell) {
    if (surface.outer_of[shell] != kNoShell) continue;
    Triangles& mesh = groups.at("body_" + std::to_string(body++));
    mesh.points = points;
    EXPECT_TRUE(IsWatertight(mesh));
    double expected = surface.measures[shell].volume;
    for (std::size_t k = 0; k < surface.ShellCount(); ++k) {
      if (surface.outer_of[k] == shell) expected += surface.measures[k].volume;
    }
    EXPECT_NEAR(Volume(mesh) / expected, 1, 1e-9);
    volume += Volume(mesh);
  }
  EXPECT_NEAR(volume / TrueVolume(surface), 1, 1e-9);
}

TEST(SurfaceFiles, ObjNamesTrackedBodies) {
  Surface surface = WithCuts(Scene());
  const auto groups = [&] {
    std::set<std::string> found;
    for (const auto& words : ObjLines(Encode(FrameFormat::kObj, surface))) {
      if (words[0] == "g" && words.size() > 2) found.insert(words[1] + " " + words[2]);
    }
    return found;
  };
  for (std::size_t k = 0; k < surface.ShellCount(); ++k) surface.measures[k].identity = 0;
  EXPECT_THAT(groups(), UnorderedElementsAre("body_0 cut", "body_1 cut"));
  std::vector<std::string> expected;
  for (std::size_t k = 0; k < surface.ShellCount(); ++k) {
    surface.measures[k].identity = 70 + k;
    if (surface.outer_of[k] != kNoShell) continue;
    expected.push_back(Concat("body_", expected.size(), " identity_", 70 + k));
  }
  EXPECT_THAT(groups(), ::testing::UnorderedElementsAreArray(expected));
}

TEST(SurfaceFiles, StlHasTheNormalsOfFacets) {
  const Surface& surface = Scene();
  const std::string stl = Encode(FrameFormat::kStl, surface);
  ASSERT_EQ(Number32(stl, 80), surface.TriangleCount());
  ASSERT_EQ(stl.size(), 84 + 50 * surface.TriangleCount());
  std::map<std::array<float, 3>, std::uint32_t> numbers;
  Triangles mesh;
  std::size_t at = 84;
  for (std::size_t k = 0; k < surface.TriangleCount(); ++k, at += 2) {
    std::array<std::array<float, 3>, 4> facet;  // Normal, then corners.
    for (auto& vector : facet) {
      for (float& component : vector) component = Next<float>(stl, at);
    }
    double length = 0, along_first = 0, along_second = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      length += facet[0][c] * facet[0][c];
      along_first += facet[0][c] * (facet[2][c] - facet[1][c]);
      along_second += facet[0][c] * (facet[3][c] - facet[1][c]);
    }
    ASSERT_NEAR(length, 1, 1e-6);
    ASSERT_NEAR(along_first, 0, 1e-5);
    ASSERT_NEAR(along_second, 0, 1e-5);
    double outwards = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      outwards += facet[0][c] * surface.normals[std::size_t{3} * surface.triangles[3 * k] + c];
    }
    ASSERT_GT(outwards, 0);
    for (std::size_t corner = 1; corner < 4; ++corner) {
      const auto [point, is_new] =
          numbers.try_emplace(facet[corner], static_cast<std::uint32_t>(numbers.size()));
      mesh.triangles.push_back(point->second);
      if (is_new) {
        mesh.points.insert(mesh.points.end(), facet[corner].begin(), facet[corner].end());
      }
    }
  }
  ExpectTheSurface(mesh, surface, 1e-6);
}

TEST(SurfaceFiles, ObjHasAGroupOfTrianglesOnWalls) {
  Surface surface = WithCuts(Scene());
  ASSERT_THAT(surface.cuts, Not(IsEmpty()));
  for (ShellMeasures& measures : surface.measures) measures.identity = 0;
  std::map<std::vector<std::string>, std::size_t> faces;
  std::vector<std::string> group;
  for (const auto& words : ObjLines(Encode(FrameFormat::kObj, surface))) {
    if (words[0] == "g") group.assign(words.begin() + 1, words.end());
    if (words[0] == "f") ++faces[group];
  }
  EXPECT_THAT(faces,
              UnorderedElementsAre(Key(ElementsAre("body_0")), Key(ElementsAre("body_0", "cut")),
                                   Key(ElementsAre("body_1")), Key(ElementsAre("body_1", "cut"))));
  EXPECT_EQ((faces[{"body_0", "cut"}] + faces[{"body_1", "cut"}]), surface.cuts.size());
}

// The array of an accessor.
template <typename T>
std::vector<T> ArrayOf(const std::string& glb, const json& file, const json& accessor) {
  const json& found = file.at("accessors")[accessor.get<std::size_t>()];
  return ValuesOf<T>(
      ViewOf(glb, file, file.at("bufferViews")[found.at("bufferView").get<std::size_t>()]));
}

TEST(SurfaceFiles, GlbHasNormalsAttributesAndAMaterial) {
  constexpr double kShift = 1e5;
  const Surface surface = HollowBallAndTorus(kShift);
  for (const bool compress : {false, true}) {
    const std::string glb = Encode(FrameFormat::kGlb, surface, {.compress_glb = compress});
    const json file = JsonOf(glb);
    ASSERT_EQ(file.at("meshes")[0].at("primitives").size(), 1u);
    const json& primitive = file["meshes"][0]["primitives"][0];
    const json& attributes = primitive.at("attributes");
    const json& centre = file.at("nodes")[0].at("translation");
    const auto positions = ArrayOf<float>(glb, file, attributes.at("POSITION"));
    Triangles mesh{
        .triangles = Rotated(
            ViewOf(glb, file, file["bufferViews"][primitive.at("indices").get<std::size_t>()]))};
    std::array<float, 3> low = {9, 9, 9}, high = {-9, -9, -9};
    for (std::size_t k = 0; k < positions.size(); ++k) {
      low[k % 3] = std::min(low[k % 3], positions[k]);
      high[k % 3] = std::max(high[k % 3], positions[k]);
      mesh.points.push_back(positions[k]);
      ASSERT_NEAR(positions[k] + centre[k % 3].get<double>(), surface.points[k], 2e-6);
    }
    ExpectTheSurface(mesh, surface, 1e-6);
    EXPECT_EQ((file["accessors"][0].at("min").get<std::array<float, 3>>()), low);
    EXPECT_EQ((file["accessors"][0].at("max").get<std::array<float, 3>>()), high);
    EXPECT_GT(high[2], 5);
    EXPECT_EQ(ArrayOf<float>(glb, file, attributes.at("NORMAL")), surface.normals);
    EXPECT_EQ(ArrayOf<float>(glb, file, attributes.at("_height")), surface.attributes[0].values);
    EXPECT_EQ(ArrayOf<float>(glb, file, attributes.at("_a,b")), surface.attributes[1].values);
    const json& material = file.at("materials")[primitive.at("material").get<std::size_t>()];
    EXPECT_EQ(file["materials"].size(), 1u);
    EXPECT_EQ(material.at("doubleSided"), false);
    EXPECT_EQ(material.at("pbrMetallicRoughness").at("metallicFactor"), 0);
  }
}

TEST(SurfaceFiles, GlbHasAPrimitiveOfTrianglesOnWalls) {
  const Surface surface = WithCuts(Scene());
  for (const bool compress : {false, true}) {
    const std::string glb = Encode(FrameFormat::kGlb, surface, {.compress_glb = compress});
    const json file = JsonOf(glb);
    const json& primitives = file.at("meshes")[0].at("primitives");
    ASSERT_EQ(primitives.size(), 2u);
    std::vector<std::vector<std::uint32_t>> triangles;
    for (const json& primitive : primitives) {
      const json& indices = file["accessors"][primitive.at("indices").get<std::size_t>()];
      triangles.push_back(Rotated(
          ViewOf(glb, file, file["bufferViews"][indices.at("bufferView").get<std::size_t>()])));
    }
    std::vector<std::vector<std::uint32_t>> expected(2);
    for (std::uint32_t k = 0; k < surface.TriangleCount(); ++k) {
      const auto corners = std::span(surface.triangles).subspan(std::size_t{3} * k, 3);
      auto& chosen = expected[std::ranges::binary_search(surface.cuts, k) ? 1 : 0];
      chosen.insert(chosen.end(), corners.begin(), corners.end());
      std::rotate(chosen.end() - 3, std::min_element(chosen.end() - 3, chosen.end()), chosen.end());
    }
    EXPECT_EQ(triangles, expected);
    json attributes = primitives[0].at("attributes");
    attributes.erase("NORMAL");
    EXPECT_EQ(primitives[1].at("attributes"), attributes) << "the same vertices, without normals";
    EXPECT_EQ(primitives[1].at("material"), 1);
    EXPECT_EQ(file.at("materials")[1].at("name"), "cut");
  }
}

TEST(SurfaceFiles, CompressionMakesASurfaceSmaller) {
  const std::size_t plain = Encode(FrameFormat::kGlb, Scene()).size();
  EXPECT_LT(Encode(FrameFormat::kGlb, Scene(), {.compress_glb = true}).size(), plain * 2 / 3);
}

TEST(SurfaceFiles, AnEmptySurfaceIsAValidFile) {
  const Surface empty;
  std::vector<std::uint32_t> triangles;
  EXPECT_THAT(ReadPly(Encode(FrameFormat::kPly, empty), triangles), IsEmpty());
  EXPECT_EQ(Encode(FrameFormat::kStl, empty).size(), 84u);
  for (const auto& words : ObjLines(Encode(FrameFormat::kObj, empty))) EXPECT_EQ(words[0], "#");
  for (const bool compress : {false, true}) {
    const json file = JsonOf(Encode(FrameFormat::kGlb, empty, {.compress_glb = compress}));
    EXPECT_EQ(file.at("scenes").size(), 1u);
    EXPECT_FALSE(file.contains("meshes"));
  }
}

TEST(SurfaceFiles, FormatsOfOutlinesRefuseSurfaces) {
  for (const FrameFormat format : {FrameFormat::kGeoJson, FrameFormat::kCsv}) {
    EXPECT_FALSE(HoldsSurfaces(format));
    const auto refused =
        EncodeFrame(format, {.result = kNoOutline, .surface = &Scene()}, {}).status();
    EXPECT_EQ(refused, CheckHoldsSurfaces(format));
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("must be some of svg,obj,"));
    EXPECT_THAT(std::string(refused.message()), HasSubstr(",glb"));
  }
  for (const FrameFormat format : {FrameFormat::kSvg, FrameFormat::kObj, FrameFormat::kVtp,
                                   FrameFormat::kPly, FrameFormat::kStl, FrameFormat::kGlb}) {
    EXPECT_TRUE(HoldsSurfaces(format)) << Name(format);
    EXPECT_TRUE(CheckHoldsSurfaces(format).ok());
  }
}

TEST(SurfaceFiles, NumbersBeyondTheFormatAreRefused) {
  Surface surface = Scene();
  surface.points[5] = 1e300;
  for (const FrameFormat format : {FrameFormat::kGlb, FrameFormat::kStl}) {
    EXPECT_EQ(EncodeFrame(format, {.result = kNoOutline, .surface = &surface}, {}).status().code(),
              absl::StatusCode::kOutOfRange);
  }
  surface.points[5] = std::numeric_limits<double>::quiet_NaN();
  for (const FrameFormat format : AllFrameFormats()) {
    if (!HoldsSurfaces(format)) continue;
    EXPECT_EQ(EncodeFrame(format, {.result = kNoOutline, .surface = &surface}, {}).status().code(),
              absl::StatusCode::kDataLoss);
  }
}

}  // namespace
}  // namespace partiemc::client
