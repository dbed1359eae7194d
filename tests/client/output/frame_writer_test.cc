// Files of frames: their names and lists, and the text formats.
#include "client/output/frame_writer.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>

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

TEST(FrameWriter, RefusesNonFiniteCoordinates) {
  Result result = SquareWithHoleAndIsland();
  result.rings.points[3] = std::numeric_limits<double>::infinity();
  for (const FrameFormat format : AllFrameFormats()) {
    const auto bytes = EncodeFrame(format, {.index = 4, .result = result}, {});
    EXPECT_EQ(bytes.status().code(), absl::StatusCode::kDataLoss) << Name(format);
    EXPECT_THAT(std::string(bytes.status().message()), HasSubstr("frame 4"));
  }
}

TEST(FrameWriter, KnowsTheNamesOfItsFiles) {
  for (const char* name : {"frame_000000.vtp", "frame_1234567.vtp", "frame_000001_section_2.vtp",
                           "frames.pvd", "frames_section_12.vtp.series"}) {
    EXPECT_TRUE(IsFrameFile(name, FrameFormat::kVtp)) << name;
    EXPECT_FALSE(IsFrameFile(name, FrameFormat::kCsv)) << name;
  }
  EXPECT_TRUE(IsFrameFile("frame_000000.csv", FrameFormat::kCsv));
  for (const char* name : {"frame_0000.csv", "frame_000000.csv.gz", "frame_.csv", "frames.csv",
                           "frame_000000_section_.csv", "a_000000.csv", "frame_-00001.csv", ""}) {
    EXPECT_FALSE(IsFrameFile(name, FrameFormat::kCsv)) << name;
  }
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

TEST(Walls, AttributesWithTheirNamesGetOthers) {
  Result result = SquareOnFloor();
  result.attributes = {{.name = "wetted", .components = 1, .values = {5, 6, 7, 8}}};
  EXPECT_THAT(Encode(FrameFormat::kCsv, {.result = result}),
              HasSubstr("ring,index,x,y,nx,ny,wetted_,wetted,contact_angle\n"
                        "0,0,0,0,,,5,1,90\n"));
  const auto formats = AllFrameFormats();
  if (std::find(formats.begin(), formats.end(), FrameFormat::kVtp) == formats.end()) return;
  const std::string vtp = Encode(FrameFormat::kVtp, {.result = result});
  EXPECT_THAT(vtp, HasSubstr("Name=\"wetted_\""));
  EXPECT_THAT(vtp, HasSubstr("Name=\"wetted\""));
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
  EXPECT_THAT(vtp, HasSubstr("type=\"UInt64\" Name=\"identity\""));
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

TEST(Stl, HasOneRecordForEachTriangle) {
  const Result result = SquareWithHoleAndIsland();
  const std::string stl = Encode(FrameFormat::kStl, {.result = result});
  EXPECT_EQ(Number32(stl, 80), 9u);
  EXPECT_EQ(stl.size(), 84u + 9 * 50);
}

TEST(Stl, IsRefusedFarFromTheOrigin) {
  Result result = SquareWithHoleAndIsland();
  const auto code = [&] {
    return EncodeFrame(FrameFormat::kStl, {.result = result}, {}).status().code();
  };
  for (double& coordinate : result.mesh.points) coordinate += 1000.3;
  EXPECT_EQ(code(), absl::StatusCode::kOk);
  for (double& coordinate : result.mesh.points) coordinate += 1e7;
  EXPECT_EQ(code(), absl::StatusCode::kOutOfRange);
  result.statistics.spacing = 0;  // Unknown: the size of the frame counts.
  EXPECT_EQ(code(), absl::StatusCode::kOutOfRange);
  for (double& coordinate : result.mesh.points) coordinate -= 1e7;
  EXPECT_EQ(code(), absl::StatusCode::kOk);
  for (double& coordinate : result.mesh.points) coordinate += 1e7;
  for (const FrameFormat format : {FrameFormat::kPly, FrameFormat::kObj, FrameFormat::kGlb}) {
    EXPECT_TRUE(EncodeFrame(format, {.result = result}, {}).ok()) << Name(format);
  }
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
