#include "client/output/frame_writer.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>

#include "client/output/color_map.h"
#include "client/output/fixtures.h"
#include "client/output/formats/stretches.h"
#include "client/output/read_files.h"
#include "client/output/text.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

std::string Encode(FrameFormat format, const FrameRecord& frame,
                   const FrameWriterOptions& options = {}) {
  auto bytes = EncodeFrame(format, frame, options);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.value_or("");
}

std::vector<double> Flat(const json& ring) {
  std::vector<double> points;
  for (const json& point : ring) {
    points.push_back(point.at(0).get<double>());
    points.push_back(point.at(1).get<double>());
  }
  return points;
}

std::size_t CountOf(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

TEST(Numbers, TheShortestFormReadsBackTheSameBits) {
  const unsigned seed = 20240611;
  std::cout << "seed " << seed << "\n";
  std::mt19937_64 random(seed);
  for (int k = 0; k < 100'000; ++k) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    std::string text;
    AppendNumber(text, value);
    double back = 0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(back), std::bit_cast<std::uint64_t>(value)) << text;
  }
  std::string text;
  AppendNumber(text, 0.1);
  EXPECT_EQ(text, "0.1");
}

TEST(GeoJson, HasOnePolygonPerOuterRing) {
  const Result result = SquareWithHoleAndIsland();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.index = 3, .result = result}));
  EXPECT_EQ(file.at("type"), "FeatureCollection");
  const json& features = file.at("features");
  ASSERT_EQ(features.size(), 2u);
  EXPECT_EQ(features[0].at("type"), "Feature");
  EXPECT_EQ(features[0].at("geometry").at("type"), "Polygon");
  ASSERT_EQ(features[0].at("geometry").at("coordinates").size(), 2u);
  EXPECT_EQ(Flat(features[0]["geometry"]["coordinates"][1]),
            (std::vector<double>{1, 1, 1, 2, 2, 2, 2, 1, 1, 1}));
  EXPECT_EQ(features[1].at("geometry").at("coordinates").size(), 1u);
}

TEST(GeoJson, EveryRingEndsWithItsFirstPoint) {
  const Result result = SquareWithHoleAndIsland();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  int rings = 0;
  for (const json& feature : file["features"]) {
    for (const json& ring : feature["geometry"]["coordinates"]) {
      EXPECT_EQ(ring.front(), ring.back());
      EXPECT_GE(ring.size(), 4u);
      ++rings;
    }
  }
  EXPECT_EQ(rings, 3);
}

TEST(GeoJson, OrientsOuterRingsAndHoles) {
  Result reversed;
  AddRing(reversed.rings, {0, 4, 4, 4, 4, 0, 0, 0}, kNoRing);
  AddRing(reversed.rings, {2, 1, 2, 2, 1, 2, 1, 1}, 0);
  for (const Result& result : {SquareWithHoleAndIsland(), reversed}) {
    const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
    for (const json& feature : file["features"]) {
      const json& rings = feature["geometry"]["coordinates"];
      for (std::size_t k = 0; k < rings.size(); ++k) {
        const double area = TwiceArea(Flat(rings[k]));
        EXPECT_TRUE(k == 0 ? area > 0 : area < 0) << "ring " << k << " of " << feature;
      }
    }
  }
}

TEST(GeoJson, OrientsRingsFarFromTheOrigin) {
  constexpr double kFar = 1e12;
  Result result;
  AddRing(result.rings, {kFar, kFar + 0.5, kFar + 0.5, kFar + 0.5, kFar + 0.5, kFar, kFar, kFar},
          kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  const std::vector<double> ring = Flat(file["features"][0]["geometry"]["coordinates"][0]);
  EXPECT_THAT(ring, ElementsAre(kFar, kFar + 0.5, kFar, kFar, kFar + 0.5, kFar, kFar + 0.5,
                                kFar + 0.5, kFar, kFar + 0.5));
}

TEST(GeoJson, HasPropertiesOfEachPolygon) {
  const Result result = SquareWithHoleAndIsland();
  const json file =
      json::parse(Encode(FrameFormat::kGeoJson, {.index = 12, .time = 0.1, .result = result}));
  EXPECT_EQ(file.at("frame"), 12);
  EXPECT_EQ(file.at("time"), 0.1);
  EXPECT_EQ(file["features"][0].at("properties"), (json{{"area", 15.0},
                                                        {"perimeter", 20.0},
                                                        {"particles", 150},
                                                        {"ring", 0},
                                                        {"identity", 7},
                                                        {"parents", {3, 7}},
                                                        {"frame", 12},
                                                        {"time", 0.1}}));
}

TEST(GeoJson, CoordinatesReadBackTheSame) {
  const double third = 1.0 / 3, tiny = std::numeric_limits<double>::denorm_min();
  Result result;
  AddRing(result.rings, {third, tiny, 1e300, 0.1 + 0.2, -2.0 / 3, 5}, kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  EXPECT_THAT(Flat(file["features"][0]["geometry"]["coordinates"][0]),
              ElementsAre(third, tiny, 1e300, 0.1 + 0.2, -2.0 / 3, 5, third, tiny));
}

TEST(GeoJson, WritesAnEmptyFrameAsAnEmptyCollection) {
  const Result result;
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  EXPECT_THAT(file.at("features"), IsEmpty());
}

TEST(GeoJson, WritesASelfIntersectingRingUnchanged) {
  Result bow_tie;
  AddRing(bow_tie.rings, {0, 0, 2, 2, 2, 0, 0, 2}, kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = bow_tie}));
  EXPECT_EQ(file["features"][0]["geometry"]["coordinates"][0].size(), 5u);
}

TEST(GeoJson, ATimeThatIsNotFiniteIsNull) {
  const Result result;
  const json file = json::parse(Encode(
      FrameFormat::kGeoJson, {.time = std::numeric_limits<double>::quiet_NaN(), .result = result}));
  EXPECT_TRUE(file.at("time").is_null());
}

TEST(FrameWriter, RefusesNonFiniteCoordinates) {
  Result result = SquareWithHoleAndIsland();
  result.rings.points[3] = std::numeric_limits<double>::infinity();
  for (const FrameFormat format : AllFrameFormats()) {
    const auto bytes = EncodeFrame(format, {.index = 4, .result = result}, {});
    EXPECT_EQ(bytes.status().code(), absl::StatusCode::kDataLoss) << Name(format);
    EXPECT_THAT(std::string(bytes.status().message()), HasSubstr("frame 4"));
  }
}

TEST(Svg, UsesTheBoxOfTheSequence) {
  Result result;
  AddRing(result.rings, {0, 0, 1, 0, 0, 1}, kNoRing);
  const std::string svg =
      Encode(FrameFormat::kSvg, {.result = result}, {.picture_box = Box{0, 0, 2, 1}});
  // The longer side, 2, and two margins of 0.04 have 1000 units: 480.769 per unit of length.
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 1000 519.231\""));
  EXPECT_THAT(svg, HasSubstr("d=\"M19.231 500L500 500L19.231 19.231Z\""));
}

TEST(Stretches, EndAtCuts) {
  Result result;
  result.rings.points.resize(2 * 11);
  result.rings.offsets = {0, 3, 7, 11};
  result.rings.outer_of = {kNoRing, kNoRing, kNoRing};
  result.rings.cuts = {4, 5, 7, 8, 9, 10};
  std::vector<std::string> stretches;
  ForEachStretch(result.rings,
                 [&](std::size_t ring, std::span<const std::uint32_t> points, bool is_closed) {
                   std::string text = std::to_string(ring) + ":";
                   for (const std::uint32_t point : points) text += " " + std::to_string(point);
                   stretches.push_back(text + (is_closed ? " closed" : ""));
                 });
  EXPECT_THAT(stretches, ElementsAre("0: 0 1 2 closed", "1: 6 3 4"));
}

// A square whose bottom lies on a wall.
Result SquareOnFloor() {
  Result result;
  AddRing(result.rings, {0, 0, 2, 0, 2, 2, 0, 2}, kNoRing);
  result.rings.normals.clear();
  result.rings.wetted = {0};
  result.rings.contacts = {0, 1};
  result.rings.contact_angles = {std::numbers::pi_v<float> / 2, std::numbers::pi_v<float> / 4};
  return result;
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

TEST(Csv, HasColumnsOfWalls) {
  EXPECT_EQ(Encode(FrameFormat::kCsv, {.result = SquareOnFloor()}),
            "ring,index,x,y,nx,ny,wetted,contact_angle\n"
            "0,0,0,0,,,1,90\n0,1,2,0,,,0,45\n0,2,2,2,,,0,\n0,3,0,2,,,0,\n");
}

TEST(Vtp, HasPointDataOfWalls) {
  const auto formats = AllFrameFormats();
  if (std::find(formats.begin(), formats.end(), FrameFormat::kVtp) == formats.end()) return;
  const std::string vtp = Encode(FrameFormat::kVtp, {.result = SquareOnFloor()});
  EXPECT_THAT(vtp, HasSubstr("Name=\"wetted\""));
  EXPECT_THAT(vtp, HasSubstr("Name=\"contact_angle\""));
  EXPECT_THAT(Encode(FrameFormat::kVtp, {.result = SquareWithHoleAndIsland()}),
              Not(HasSubstr("wetted")));
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

TEST(Svg, AnEmptyFrameIsAPictureToo) {
  const Result result;
  const std::string svg = Encode(FrameFormat::kSvg, {.result = result});
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(Obj, SharesVerticesOfFacesAndRings) {
  const Result result = SquareWithHoleAndIsland();
  const auto lines = ObjLines(Encode(FrameFormat::kObj, {.result = result}));
  std::size_t vertices = 0, faces = 0;
  std::vector<std::vector<std::string>> polylines;
  for (const auto& words : lines) {
    if (words[0] == "v") {
      ASSERT_EQ(words.size(), 4u);
      EXPECT_EQ(words[3], "0");
      ++vertices;
    }
    if (words[0] == "f") ++faces;
    if (words[0] == "l") polylines.push_back(words);
  }
  EXPECT_EQ(vertices, 11u);
  EXPECT_EQ(faces, 9u);
  EXPECT_THAT(polylines, ElementsAre(ElementsAre("l", "1", "2", "3", "4", "1"),
                                     ElementsAre("l", "5", "6", "7", "5"),
                                     ElementsAre("l", "8", "9", "10", "11", "8")));
  EXPECT_THAT(lines, ::testing::Contains(ElementsAre("f", "1", "2", "11")));
}

TEST(Obj, WithoutAMeshThereAreOnlyPolylines) {
  Result result = SquareWithHoleAndIsland();
  result.mesh = {};
  const std::string obj = Encode(FrameFormat::kObj, {.result = result});
  EXPECT_EQ(CountOf(obj, "\nv "), 11u);
  EXPECT_EQ(CountOf(obj, "\nf "), 0u);
  EXPECT_EQ(CountOf(obj, "\nl "), 3u);
}

TEST(Obj, GivesAnUnrelatedMeshItsOwnVertices) {
  Result result = SquareWithHoleAndIsland();
  result.mesh.points[0] = -1;
  const std::string obj = Encode(FrameFormat::kObj, {.result = result});
  EXPECT_EQ(CountOf(obj, "\nv "), 22u);
  EXPECT_THAT(obj, HasSubstr("\nl 12 13 14 15 12\n"));
}

TEST(Csv, ThereIsOneRowPerVertexWithItsNormal) {
  Result result;
  AddRing(result.rings, {1, 0, 0.1, 1, -1, 0, 0, -1}, kNoRing);
  result.rings.normals = {1, 0, 0, 1, -1, 0, 0.1F, -1};
  EXPECT_EQ(Encode(FrameFormat::kCsv, {.result = result}),
            "ring,index,x,y,nx,ny\n0,0,1,0,1,0\n0,1,0.1,1,0,1\n0,2,-1,0,-1,0\n0,3,0,-1,0.1,-1\n");
}

TEST(Csv, WithoutNormalsTheirColumnsAreEmpty) {
  Result result;
  AddRing(result.rings, {1, 0, 0, 1, -1, 0}, kNoRing);
  result.rings.normals.clear();
  EXPECT_THAT(Encode(FrameFormat::kCsv, {.result = result}), HasSubstr("\n0,2,-1,0,,\n"));
}

TEST(Vtp, HasLinesBeforePolygonsWithClasses) {
  const Result result = SquareWithHoleAndIsland();
  const auto formats = AllFrameFormats();
  if (std::find(formats.begin(), formats.end(), FrameFormat::kVtp) == formats.end()) {
    const auto refused = ParseFrameFormats("vtp");
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(std::string(refused.status().message()), HasSubstr("needs a build with VTK"));
    return;
  }
  const std::string vtp = Encode(FrameFormat::kVtp, {.time = 0.5, .result = result});
  EXPECT_THAT(vtp, HasSubstr("NumberOfPoints=\"11\""));
  EXPECT_THAT(vtp, HasSubstr("NumberOfLines=\"3\""));
  EXPECT_THAT(vtp, HasSubstr("NumberOfPolys=\"9\""));
  EXPECT_THAT(vtp, HasSubstr("Name=\"class\""));
  EXPECT_THAT(vtp, HasSubstr("TimeValue"));
  EXPECT_THAT(vtp, HasSubstr("</VTKFile>"));
}

TEST(FrameWriter, NumbersFilesByTheIndexInTheInput) {
  support::TemporaryFolder directory;
  auto writer = FrameWriter::Create({.directory = directory / "made/on/the/way",
                                     .formats = {FrameFormat::kGeoJson, FrameFormat::kObj}});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const Result result = SquareWithHoleAndIsland();
  ASSERT_TRUE(writer->Write({.index = 42, .result = result}).ok());
  ASSERT_TRUE(writer->Write({.index = 12345678, .result = result}).ok());
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory / "made/on/the/way")) {
    names.push_back(entry.path().filename().native());
  }
  EXPECT_THAT(names, UnorderedElementsAre("frame_000042.geojson", "frame_000042.obj",
                                          "frame_12345678.geojson", "frame_12345678.obj"));
}

TEST(FrameWriter, WritesSectionsAsFilesAndAsLines) {
  support::TemporaryFolder directory;
  Result result = SquareWithHoleAndIsland();
  result.sections.resize(2);
  AddRing(result.sections[0].rings, {1, 1, 3, 1, 3, 3}, kNoRing);
  AddRing(result.sections[1].rings, {-7, 1, 3, 1, 3, 3}, kNoRing);
  auto writer = FrameWriter::Create(
      {.directory = directory / "out", .formats = {FrameFormat::kSvg, FrameFormat::kGeoJson}});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const std::vector<std::size_t> in_plane = {0};
  const std::vector<double> particles = {2.0, 2.0};
  ASSERT_TRUE(
      writer
          ->Write(
              {.index = 7, .result = result, .particles = particles, .sections_in_plane = in_plane})
          .ok());
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory / "out")) {
    names.push_back(entry.path().filename().string());
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre(
                         "frame_000007.svg", "frame_000007.geojson", "frame_000007_section_1.svg",
                         "frame_000007_section_1.geojson", "frame_000007_section_2.svg",
                         "frame_000007_section_2.geojson"));
  const std::string picture = ReadFile(directory / "out/frame_000007.svg");
  std::size_t isolines = 0;
  for (std::size_t at = picture.find("class=\"isoline\""); at != std::string::npos;
       at = picture.find("class=\"isoline\"", at + 1)) {
    ++isolines;
  }
  EXPECT_EQ(isolines, 1u);
  EXPECT_THAT(ReadFile(directory / "out/frame_000007_section_2.geojson"), HasSubstr("-7"));
  EXPECT_THAT(ReadFile(directory / "out/frame_000007_section_2.svg"),
              ::testing::Not(HasSubstr("class=\"particles\"")))
      << "they need not lie in its plane";
}

TEST(FrameWriter, ReportsAVanishedDirectory) {
  support::TemporaryFolder directory;
  auto writer =
      FrameWriter::Create({.directory = directory / "out", .formats = {FrameFormat::kSvg}});
  ASSERT_TRUE(writer.ok());
  std::filesystem::remove(directory / "out");
  const Result result = SquareWithHoleAndIsland();
  const absl::Status status = writer->Write({.index = 7, .result = result});
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("frame_000007.svg"));
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(FrameWriter, RefusesAFileInsteadOfADirectory) {
  support::TemporaryFolder directory;
  std::ofstream(directory / "out") << "a file";
  auto writer = FrameWriter::Create({.directory = directory / "out"});
  EXPECT_FALSE(writer.ok());
  EXPECT_EQ(ReadFile(directory / "out"), "a file");
}

TEST(FrameFormats, ListsKeepTheirOrderWithoutDuplicates) {
  const auto formats = ParseFrameFormats("svg,geojson,svg");
  ASSERT_TRUE(formats.ok());
  EXPECT_THAT(*formats, ElementsAre(FrameFormat::kSvg, FrameFormat::kGeoJson));
}

TEST(FrameFormats, NamesAnUnknownFormatAndTheKnownOnes) {
  for (const char* list : {"svg,dxf", "dxf", "svg,", ""}) {
    const auto formats = ParseFrameFormats(list);
    ASSERT_EQ(formats.status().code(), absl::StatusCode::kInvalidArgument) << list;
    EXPECT_THAT(std::string(formats.status().message()), HasSubstr("must be some of geojson,svg"));
  }
}

// The square with hole and island, with a linear field and a vector at every point.
Result WithAttributes() {
  Result result = SquareWithHoleAndIsland();
  AttributeValues height{"height", 1, {}}, place{"a,b", 2, {}};
  for (std::size_t k = 0; k < result.mesh.points.size(); k += 2) {
    height.values.push_back(static_cast<float>(result.mesh.points[k + 1]));
    place.values.push_back(static_cast<float>(result.mesh.points[k]));
    place.values.push_back(static_cast<float>(result.mesh.points[k + 1]));
  }
  result.attributes = {height, place};
  return result;
}

TEST(Csv, HasAColumnForEachNumberOfAnAttribute) {
  const Result result = WithAttributes();
  std::istringstream lines(Encode(FrameFormat::kCsv, {.result = result}));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "ring,index,x,y,nx,ny,height,\"a,b:0\",\"a,b:1\"");
  std::getline(lines, line);
  EXPECT_TRUE(line.ends_with(",0,0,0")) << line;
  std::getline(lines, line);
  EXPECT_TRUE(line.ends_with(",0,4,0")) << line;
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

TEST(GeoJson, PolygonsHaveTheMeanAndTheRangeOfTheirAttributes) {
  const Result result = WithAttributes();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  const json properties = file["features"][0].at("properties");
  // The square has the heights 0, 0, 4, 4, and its hole is inside.
  EXPECT_EQ(properties.at("height_min"), 0);
  EXPECT_EQ(properties.at("height_max"), 4);
  EXPECT_GT(properties.at("height_mean"), 1);
  EXPECT_LT(properties.at("height_mean"), 3);
  EXPECT_EQ(properties.at("a,b:0_max"), 4);
  EXPECT_TRUE(properties.contains("a,b:1_mean"));
}

TEST(Glb, HasTrianglesLinesAndAttributes) {
  Result result = WithAttributes();
  result.attributes[1].name = "a\"b\n";
  const json file = JsonOf(Encode(FrameFormat::kGlb, {.index = 3, .time = 0.5, .result = result}));
  EXPECT_EQ(file.at("extras"), (json{{"frame", 3}, {"time", 0.5}}));
  const json primitives = file.at("meshes")[0].at("primitives");
  ASSERT_EQ(primitives.size(), 2u);
  EXPECT_EQ(primitives[0].at("mode"), 4);
  EXPECT_EQ(primitives[1].at("mode"), 1);
  const json& accessors = file.at("accessors");
  EXPECT_EQ(accessors[primitives[0].at("indices").get<std::size_t>()].at("count"), 27);
  EXPECT_EQ(accessors[primitives[1].at("indices").get<std::size_t>()].at("count"), 22);
  const json attributes = primitives[0].at("attributes");
  EXPECT_EQ(accessors[attributes.at("_height").get<std::size_t>()].at("type"), "SCALAR");
  EXPECT_EQ(accessors[attributes.at("_a\"b\n").get<std::size_t>()].at("type"), "VEC2");
  EXPECT_EQ(accessors[attributes.at("POSITION").get<std::size_t>()].at("count"), 11);
}

TEST(Glb, KeepsItsPrecisionFarFromTheOrigin) {
  constexpr double kFar = 1e6;
  Result result;
  AddRing(result.rings, {kFar, kFar, kFar + 0.25, kFar, kFar, kFar + 0.25}, kNoRing);
  const json file = JsonOf(Encode(FrameFormat::kGlb, {.result = result}));
  EXPECT_EQ(file.at("nodes")[0].at("translation"), (json{kFar + 0.125, kFar + 0.125, 0}));
  EXPECT_EQ(file.at("accessors")[0].at("max"), (json{0.125, 0.125, 0}));
}

TEST(Glb, AnEmptyFrameIsAnEmptyScene) {
  const Result result;
  for (const bool compress : {false, true}) {
    const std::string glb =
        Encode(FrameFormat::kGlb, {.result = result}, {.compress_glb = compress});
    const json file = JsonOf(glb);
    EXPECT_FALSE(file.contains("meshes"));
    EXPECT_FALSE(file.contains("extensionsRequired"));
    EXPECT_EQ(file.at("scenes").size(), 1u);
  }
}

TEST(Glb, CompressedArraysDecodeToTheSameBits) {
  Result result = WithAttributes();
  result.mesh.points[0] = result.rings.points[0] = 0.1;
  result.attributes[0].values[3] = std::numeric_limits<float>::quiet_NaN();
  const FrameRecord frame{.index = 3, .time = 0.5, .result = result};
  const std::string plain = Encode(FrameFormat::kGlb, frame);
  const std::string packed = Encode(FrameFormat::kGlb, frame, {.compress_glb = true});
  const json file = JsonOf(plain), packed_file = JsonOf(packed);
  for (const char* same : {"accessors", "meshes", "nodes", "extras"}) {
    EXPECT_EQ(packed_file.at(same), file.at(same));
  }
  EXPECT_TRUE(packed_file.at("buffers")[1]["extensions"]["EXT_meshopt_compression"]["fallback"]);
  const std::size_t triangles = file["meshes"][0]["primitives"][0]["indices"];
  ASSERT_EQ(file.at("bufferViews").size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    const std::string expected = ViewOf(plain, file, file.at("bufferViews")[k]);
    const std::string found = ViewOf(packed, packed_file, packed_file.at("bufferViews")[k]);
    if (k == triangles) {
      EXPECT_EQ(Rotated(found), Rotated(expected));
    } else {
      EXPECT_EQ(found, expected) << k;
    }
  }
}

TEST(Glb, CompressionMakesALargeMeshSmaller) {
  Result result;
  constexpr std::uint32_t kSide = 40;
  for (std::uint32_t k = 0; k < kSide * kSide; ++k) {
    result.mesh.points.insert(result.mesh.points.end(), {0.1 * (k % kSide), 0.1 * (k / kSide)});
    if (k % kSide + 1 == kSide || k / kSide + 1 == kSide) continue;
    const std::vector<std::uint32_t> two = {k, k + 1, k + kSide, k + 1, k + kSide + 1, k + kSide};
    result.mesh.triangles.insert(result.mesh.triangles.end(), two.begin(), two.end());
  }
  const std::size_t plain = Encode(FrameFormat::kGlb, {.result = result}).size();
  EXPECT_LT(Encode(FrameFormat::kGlb, {.result = result}, {.compress_glb = true}).size(),
            plain / 4);
}

TEST(Ply, WithoutAMeshTheRingsAreEdges) {
  Result result = SquareWithHoleAndIsland();
  result.mesh = {};
  const std::string ply = Encode(FrameFormat::kPly, {.result = result});
  EXPECT_THAT(ply, HasSubstr("element vertex 11\n"));
  EXPECT_THAT(ply, HasSubstr("element edge 11\n"));
  EXPECT_EQ(ply.size(), ply.find("end_header\n") + 11 + 11 * 24 + 11 * 8);
}

TEST(Ply, NamesOfPropertiesAreUnique) {
  Result result = SquareWithHoleAndIsland();
  const std::vector<float> values(result.mesh.PointCount(), 1);
  result.attributes = {{"y", 1, values}, {"a.b", 1, values}, {"a_b", 1, values}};
  const std::string ply = Encode(FrameFormat::kPly, {.result = result});
  for (const char* name : {"float y_\n", "float a_b\n", "float a_b_\n"}) {
    EXPECT_THAT(ply, HasSubstr(name));
  }
}

TEST(Glb, CoordinatesBeyondFloatsAreRefused) {
  Result result = SquareWithHoleAndIsland();
  for (double& coordinate : result.rings.points) coordinate *= 1e40;
  result.mesh = {};
  for (const FrameFormat format : {FrameFormat::kGlb, FrameFormat::kStl}) {
    EXPECT_EQ(EncodeFrame(format, {.result = result}, {}).status().code(),
              absl::StatusCode::kOutOfRange);
  }
}

TEST(Stl, HasOneRecordForEachTriangle) {
  const Result result = SquareWithHoleAndIsland();
  const std::string stl = Encode(FrameFormat::kStl, {.result = result});
  EXPECT_EQ(Number32(stl, 80), 9u);
  EXPECT_EQ(stl.size(), 84u + 9 * 50);
}

TEST(FrameWriter, ListsVtpFilesWithTheirTimes) {
  const auto formats = AllFrameFormats();
  if (std::find(formats.begin(), formats.end(), FrameFormat::kVtp) == formats.end()) return;
  support::TemporaryFolder directory;
  auto writer =
      FrameWriter::Create({.directory = directory / "out", .formats = {FrameFormat::kVtp}});
  ASSERT_TRUE(writer.ok()) << writer.status();
  Result result = SquareWithHoleAndIsland();
  result.sections.resize(1);
  ASSERT_TRUE(writer->Write({.index = 4, .time = 0.5, .result = result}).ok());
  ASSERT_TRUE(writer->Write({.index = 6, .time = 0.75, .result = result}).ok());
  ASSERT_TRUE(writer->Finish().ok());
  const json series = json::parse(ReadFile(directory / "out/frames.vtp.series"));
  EXPECT_EQ(series.at("files"), (json{{{"name", "frame_000004.vtp"}, {"time", 0.5}},
                                      {{"name", "frame_000006.vtp"}, {"time", 0.75}}}));
  EXPECT_THAT(ReadFile(directory / "out/frames.pvd"),
              HasSubstr("<DataSet timestep=\"0.75\" part=\"0\" file=\"frame_000006.vtp\"/>"));
  EXPECT_THAT(ReadFile(directory / "out/frames_section_1.pvd"),
              HasSubstr("file=\"frame_000004_section_1.vtp\""));
}

}  // namespace
}  // namespace partiemc::client
