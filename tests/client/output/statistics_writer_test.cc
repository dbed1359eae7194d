#include "client/output/statistics_writer.h"

#include <limits>
#include <numbers>

#include "client/output/fixtures.h"
#include "client/output/surface_scene.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kHeader =
    "frame,particles,polylines,vertices,triangles_grid,triangles,area,milliseconds,"
    "bins_ms,field_ms,crossings_ms,rings_ms,normals_ms,vertices_ms,identities_ms,mesh_ms,"
    "attributes_ms,perimeter,self_intersections,folded_triangles,dropped_holes,dropped_components,"
    "dropped_spray,rings_digest,mesh_digest,time,doubts,section";

FrameRecord Record(const Result& result) {
  return {.index = 3,
          .time = 0.1,
          .result = result,
          .stages_ms = {1, 2, 3, 4, 5, 6, 7, 8, 9},
          .total_ms = 28.5,
          .rings_digest = 0x0123456789abcdef,
          .mesh_digest = 0xf};
}

std::string Written(const std::filesystem::path& path, const std::vector<FrameRecord>& frames) {
  auto writer = StatisticsWriter::Create(path);
  EXPECT_TRUE(writer.ok()) << writer.status();
  for (const FrameRecord& frame : frames) EXPECT_TRUE(writer->Add(frame).ok());
  EXPECT_TRUE(writer->Finish().ok());
  return ReadFile(path);
}

TEST(Statistics, CsvHasTheDocumentedColumns) {
  support::TemporaryFolder directory;
  Result result = SquareWithHoleAndIsland();
  result.statistics.perimeter = 23.5;
  result.statistics.self_intersections = 1;
  result.statistics.folded_triangles = 2;
  result.statistics.dropped_holes = 3;
  result.statistics.dropped_components = 4;
  result.statistics.dropped_spray = 5;
  EXPECT_EQ(Written(directory / "stats.csv", {Record(result)}),
            std::string(kHeader) +
                "\n3,155,3,11,36,9,15.5,28.5,1,2,3,4,5,6,7,8,9,23.5,1,2,3,4,5,"
                "0123456789abcdef,000000000000000f,0.1,,0\n");
}

TEST(Statistics, WallsAddColumns) {
  support::TemporaryFolder directory;
  Result result = SquareWithHoleAndIsland();
  // The bottom of the square, 4 long, and the last side of the hole, 1 long.
  result.rings.wetted = {0, 10};
  result.rings.contacts = {0, 1};
  result.rings.contact_angles = {std::numbers::pi_v<float> / 2, std::numbers::pi_v<float> / 6};
  const auto written = [&](const char* name) {
    const std::vector<Gauge> gauges =
        ParseGauges({"level=height:0.5"}, StatisticsOf::kOutlinesAtWalls).value();
    auto writer =
        StatisticsWriter::Create(directory / name, gauges, StatisticsOf::kOutlinesAtWalls);
    EXPECT_TRUE(writer.ok()) << writer.status();
    EXPECT_TRUE(writer->Add(Record(result)).ok());
    EXPECT_TRUE(writer->Add(Record(SquareWithHoleAndIsland())).ok());
    EXPECT_TRUE(writer->Finish().ok());
    return ReadFile(directory / name);
  };
  EXPECT_THAT(written("stats.csv"),
              HasSubstr(",section,wetted_length,contacts,contact_angle,level_highest"));
  const ordered_json rows = ordered_json::parse(written("stats.json"));
  EXPECT_EQ(rows[0]["wetted_length"], 5);
  EXPECT_EQ(rows[0]["contacts"], 2);
  EXPECT_NEAR(rows[0]["contact_angle"], 60, 1e-4);
  EXPECT_EQ(rows[1]["wetted_length"], 0);
  EXPECT_TRUE(rows[1]["contact_angle"].is_null());
  EXPECT_EQ(
      ParseGauges({"contacts=wetted:0,2,9,2"}, StatisticsOf::kOutlinesAtWalls).status().code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(ParseGauges({"contacts=wetted:0,2,9,2"}).ok());
}

TEST(Statistics, GaugesAddColumns) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  const auto written = [&](const char* name) {
    auto gauges = ParseGauges({"level=height:0.5", "wet=wetted:0,2,9,2"});
    EXPECT_TRUE(gauges.ok()) << gauges.status();
    auto writer = StatisticsWriter::Create(directory / name, *std::move(gauges));
    EXPECT_TRUE(writer.ok() && writer->Add(Record(result)).ok() && writer->Finish().ok());
    return ReadFile(directory / name);
  };
  const std::string csv = written("stats.csv");
  EXPECT_THAT(
      csv, HasSubstr(std::string(kHeader) + ",level_highest,level_lowest,level_crossings,wet\n"));
  const auto row = ordered_json::parse(written("stats.json"))[0];
  EXPECT_EQ(row["level_highest"], Measure(ParseGauge("level=height:0.5").value(), result)[0]);
  EXPECT_GT(row["wet"], 0);
}

TEST(Statistics, PackingUsesTheParticlesOfTheFrame) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {1, 1};
  const std::vector<float> areas = {0.25};
  const auto row_of = [&](const FrameRecord& record) {
    auto writer = StatisticsWriter::Create(directory / "stats.json",
                                           ParseGauges({"p=packing:0,0,4,4"}).value());
    EXPECT_TRUE(writer.ok() && writer->Add(record).ok() && writer->Finish().ok());
    return ordered_json::parse(ReadFile(directory / "stats.json"))[0];
  };
  FrameRecord record = Record(result);
  EXPECT_TRUE(row_of(record)["p_fraction"].is_null());
  record.particles = particles;
  record.particle_areas = areas;
  const auto row = row_of(record);
  EXPECT_NEAR(row["p_discs"], 0.25, 1e-12);
  EXPECT_NEAR(row["p_fraction"], 0.25 / row["p_area"].get<double>(), 1e-12);
}

TEST(Statistics, RefusesGaugesWithColumnsThatExist) {
  for (const auto& texts : std::vector<std::vector<std::string>>{
           {"area=wetted:0,0,1,1"}, {"a=repose", "a=repose"}, {"a=depth:1"}}) {
    EXPECT_EQ(ParseGauges(texts).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(Statistics, SectionsHaveRowsOfTheirOwn) {
  support::TemporaryFolder directory;
  Result result = SquareWithHoleAndIsland();
  result.sections.resize(2);
  result.sections[1].statistics.area = 77;
  FrameRecord record = Record(result);
  const std::vector<OutlineDigests> digests = {{1, 2}, {3, 4}};
  record.section_digests = digests;
  const std::string csv = Written(directory / "stats.csv", {record});
  EXPECT_THAT(csv, HasSubstr(",0000000000000001,0000000000000002,0.1,,1\n"));
  EXPECT_THAT(csv, HasSubstr("\n3,0,0,0,0,0,77,0,"));
  EXPECT_THAT(csv, HasSubstr(",0000000000000003,0000000000000004,0.1,,2\n"));
}

TEST(Statistics, NamesDoubtsInOneCell) {
  support::TemporaryFolder directory;
  Result result = SquareWithHoleAndIsland();
  result.statistics.doubts.Add(Doubt::kVolumesContradictSpacing);
  result.statistics.doubts.Add(Doubt::kSpacingProvisional);
  constexpr const char* kNames = "spacing-provisional volumes-contradict-spacing";
  EXPECT_THAT(Written(directory / "stats.csv", {Record(result)}),
              HasSubstr(std::string(",0.1,") + kNames + ",0\n"));
  const auto rows = ordered_json::parse(Written(directory / "stats.json", {Record(result)}));
  EXPECT_EQ(rows[0].at("doubts"), kNames);
}

TEST(Statistics, JsonIsAnArrayOfObjects) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  const auto rows =
      ordered_json::parse(Written(directory / "stats.JSON", {Record(result), Record(result)}));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].at("frame"), 3);
  EXPECT_EQ(rows[1].at("triangles_grid"), 36);
  EXPECT_EQ(rows[1].at("milliseconds"), 28.5);
  EXPECT_EQ(rows[1].at("rings_digest"), "0123456789abcdef");
}

TEST(Statistics, HasUniqueColumnNames) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  const auto rows = ordered_json::parse(Written(directory / "stats.json", {Record(result)}));
  EXPECT_EQ(rows[0].size(), StatisticsColumns().size());
}

TEST(Statistics, WritesNoFramesAsHeaderOrEmptyArray) {
  support::TemporaryFolder directory;
  EXPECT_EQ(Written(directory / "stats.csv", {}), std::string(kHeader) + "\n");
  EXPECT_THAT(ordered_json::parse(Written(directory / "stats.json", {})), IsEmpty());
}

TEST(Statistics, AnAreaReadsBackTheSame) {
  support::TemporaryFolder directory;
  Result result;
  result.statistics.area = 0.1 + 0.2;
  const auto rows = ordered_json::parse(Written(directory / "stats.json", {Record(result)}));
  EXPECT_EQ(rows[0].at("area").get<double>(), 0.1 + 0.2);
}

TEST(Statistics, WritesNonFiniteNumbersAsNullInJson) {
  support::TemporaryFolder directory;
  Result result;
  result.statistics.area = std::numeric_limits<double>::quiet_NaN();
  const auto rows = ordered_json::parse(Written(directory / "stats.json", {Record(result)}));
  EXPECT_TRUE(rows[0].at("area").is_null());
}

StatisticsWriter WriterOfSurfaces(const std::filesystem::path& path) {
  auto writer = StatisticsWriter::Create(path, {}, StatisticsOf::kSurfaces);
  EXPECT_TRUE(writer.ok()) << writer.status();
  return *std::move(writer);
}

TEST(SurfaceStatistics, CsvHasTheDocumentedColumns) {
  support::TemporaryFolder directory;
  StatisticsWriter writer = WriterOfSurfaces(directory / "stats.csv");
  // Two tetrahedra, a cavity in the second one.
  Surface surface;
  surface.points.resize(36);
  surface.triangles.resize(36);
  surface.point_offsets = surface.triangle_offsets = {0, 4, 8, 12};
  surface.outer_of = {kNoShell, kNoShell, 1};
  surface.measures = {{.area = 2, .volume = 0.5, .particles = 7},
                      {.area = 20, .volume = 8, .particles = 90},
                      {.area = 1.5, .volume = -0.25}};
  surface.statistics = {.dropped_cavities = 3, .dropped_components = 4, .dropped_spray = 5};
  Result result;
  result.statistics.particles = 99;
  result.statistics.doubts.Add(Doubt::kPositionsCoarse);
  const FrameRecord record{.index = 3,
                           .time = 0.1,
                           .result = result,
                           .surface = &surface,
                           .total_ms = 28.5,
                           .surface_digest = 0xabc};
  ASSERT_TRUE(writer.Add(record).ok());
  ASSERT_TRUE(writer.Finish().ok());
  EXPECT_EQ(ReadFile(directory / "stats.csv"),
            "frame,particles,bodies,cavities,points,triangles,genus,area,volume,milliseconds,"
            "dropped_cavities,dropped_components,dropped_spray,surface_digest,time,doubts\n"
            "3,99,2,1,12,12,0,23.5,8.25,28.5,3,4,5,0000000000000abc,0.1,positions-coarse\n");
}

TEST(SurfaceStatistics, CountsHandles) {
  support::TemporaryFolder directory;
  StatisticsWriter writer = WriterOfSurfaces(directory / "stats.json");
  const Surface surface = HollowBallAndTorus(), empty;
  const Result result;
  ASSERT_TRUE(writer.Add({.result = result, .surface = &surface}).ok());
  ASSERT_TRUE(writer.Add({.index = 1, .result = result, .surface = &empty}).ok());
  ASSERT_TRUE(writer.Finish().ok());
  const auto rows = ordered_json::parse(ReadFile(directory / "stats.json"));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].size(), StatisticsColumns(StatisticsOf::kSurfaces).size());
  EXPECT_EQ(rows[0].at("genus"), 1);
  EXPECT_EQ(rows[0].at("bodies"), 2);
  EXPECT_EQ(rows[0].at("cavities"), 1);
  EXPECT_EQ(rows[0].at("triangles"), surface.TriangleCount());
  EXPECT_EQ(rows[1].at("genus"), 0);
  EXPECT_EQ(rows[1].at("volume"), 0);
}

TEST(SurfaceStatistics, AFileHasEitherOutlinesOrSurfaces) {
  support::TemporaryFolder directory;
  StatisticsWriter surfaces = WriterOfSurfaces(directory / "surfaces.csv");
  const Result result;
  const Surface surface;
  EXPECT_EQ(surfaces.Add({.result = result}).code(), absl::StatusCode::kInvalidArgument);
  auto outlines = StatisticsWriter::Create(directory / "outlines.csv");
  ASSERT_TRUE(outlines.ok());
  EXPECT_EQ(outlines->Add({.result = result, .surface = &surface}).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(SurfaceStatistics, RefusesGauges) {
  support::TemporaryFolder directory;
  EXPECT_EQ(
      StatisticsWriter::Create(directory / "stats.csv", ParseGauges({"level=height:0.5"}).value(),
                               StatisticsOf::kSurfaces)
          .status()
          .code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(Statistics, RefusesOtherExtensions) {
  support::TemporaryFolder directory;
  const auto writer = StatisticsWriter::Create(directory / "stats.txt");
  EXPECT_EQ(writer.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(writer.status().message()), HasSubstr("must end in .csv or .json"));
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(Statistics, WithoutFinishThereIsNoFile) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  {
    auto writer = StatisticsWriter::Create(directory / "stats.csv");
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->Add(Record(result)).ok());
  }
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

}  // namespace
}  // namespace partiemc::client
