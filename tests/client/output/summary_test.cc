#include "client/output/summary.h"

#include <sstream>

#include "client/output/fixtures.h"
#include "client/output/surface_scene.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Frames k = 1..100 with k milliseconds, 1000 k particles and a quarter of the grid's triangles.
Summary HundredFrames() {
  Summary summary;
  for (std::uint64_t k = 1; k <= 100; ++k) {
    Result result = SquareWithHoleAndIsland();
    result.statistics.particles = 1000 * k;
    result.statistics.triangles_grid = 4 * k;
    result.statistics.triangles = k;
    summary.Add({.result = result, .stages_ms = {0.25}, .total_ms = static_cast<double>(k)});
  }
  return summary;
}

SummaryRow RowOf(const Summary& summary, const std::string& label) {
  for (const SummaryRow& row : summary.Rows()) {
    if (row.label == label) return row;
  }
  ADD_FAILURE() << "no row " << label;
  return {};
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(Summary, HasMeanMedianAndPercentile) {
  const Summary summary = HundredFrames();
  const SummaryRow whole = RowOf(summary, "  whole frame");
  EXPECT_EQ(whole.mean, "50.500");
  EXPECT_EQ(whole.p50, "50.000");
  EXPECT_EQ(whole.p99, "99.000");
  const SummaryRow particles = RowOf(summary, "particles");
  EXPECT_EQ(particles.mean, "50,500.0");
  EXPECT_EQ(particles.p99, "99,000");
  EXPECT_EQ(RowOf(summary, "rings").mean, "3.0");
  EXPECT_EQ(RowOf(summary, "  bins").p50, "0.250");
}

TEST(Summary, AveragesReductionOverFramesWithTriangles) {
  Summary summary = HundredFrames();
  EXPECT_DOUBLE_EQ(summary.MeanReductionPercent(), 75);
  const Result empty;
  summary.Add({.result = empty});
  EXPECT_DOUBLE_EQ(summary.MeanReductionPercent(), 75);
  EXPECT_EQ(RowOf(summary, "reduction").mean, "75.0 %");
}

TEST(Summary, EveryStageHasItsRow) {
  const Summary summary = HundredFrames();
  for (const std::string_view stage : kStageNames) {
    EXPECT_FALSE(RowOf(summary, "  " + std::string(stage)).mean.empty()) << stage;
  }
}

TEST(Summary, HeadlineHasFramesRefusalsAndRate) {
  Summary summary = HundredFrames();
  EXPECT_EQ(summary.Headline(4), "100 frames in 4.00 s, 25.0 frames per second");
  summary.AddRefused();
  summary.AddRefused();
  EXPECT_EQ(summary.Headline(4), "100 frames (and 2 refused) in 4.00 s, 25.0 frames per second");
}

TEST(Summary, ReportsDefectsOnlyIfThereAreAny) {
  Summary summary = HundredFrames();
  EXPECT_THAT(summary.Headline(1), Not(HasSubstr("self-intersections")));
  Result result;
  result.statistics.self_intersections = 3;
  result.statistics.folded_triangles = 2;
  summary.Add({.result = result});
  EXPECT_THAT(summary.Headline(1), HasSubstr("self-intersections: 3; folded triangles: 2"));
}

TEST(Summary, WarnsOncePerKindOfDoubt) {
  Summary summary = HundredFrames();
  EXPECT_TRUE(summary.Warnings().empty());
  Result result;
  result.statistics.doubts.Add(Doubt::kSpacingProvisional);
  summary.Add({.result = result});
  result.statistics.doubts.Add(Doubt::kPositionsCoarse);
  summary.Add({.result = result});
  const auto warnings = summary.Warnings();
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_THAT(warnings[0], HasSubstr("in 2 of 102 frames: spacing-provisional: "));
  EXPECT_THAT(warnings[0], HasSubstr("give the spacing"));
  EXPECT_THAT(warnings[1], HasSubstr("in 1 of 102 frames: positions-coarse: "));
}

TEST(Summary, AlignsTheTable) {
  const std::vector<std::string> lines = Lines(HundredFrames().Table(4));
  ASSERT_GT(lines.size(), 10u);
  const std::size_t width = lines[1].size();
  const std::size_t mean_end = lines[1].find("mean") + 4;
  for (std::size_t k = 1; k < lines.size(); ++k) {
    if (lines[k] == "milliseconds") continue;
    EXPECT_EQ(lines[k].size(), width) << lines[k];
    EXPECT_EQ(lines[k][mean_end], ' ') << lines[k];
    EXPECT_NE(lines[k][mean_end - 1], ' ') << lines[k];
    for (const char c : lines[k]) EXPECT_TRUE(c >= ' ' && c <= '~') << lines[k];
  }
}

TEST(Summary, CountsBodiesAndCavitiesOfSurfaces) {
  const Surface surface = HollowBallAndTorus();
  const Result result;
  Summary summary;
  for (const double ms : {1.0, 2.0, 6.0}) {
    summary.Add({.result = result, .surface = &surface, .total_ms = ms});
  }
  EXPECT_EQ(summary.frame_count(), 3u);
  EXPECT_EQ(RowOf(summary, "bodies").p50, "2");
  EXPECT_EQ(RowOf(summary, "cavities").mean, "1.0");
  EXPECT_EQ(RowOf(summary, "milliseconds").mean, "3.000");
  EXPECT_NE(RowOf(summary, "points").p50, RowOf(summary, "triangles").p50);
  for (const SummaryRow& row : summary.Rows()) EXPECT_NE(row.label, "rings");
}

TEST(Summary, HasATableWithoutFrames) {
  const Summary summary;
  EXPECT_THAT(summary.Table(0), HasSubstr("0 frames in 0.00 s\n"));
  EXPECT_THAT(summary.Table(0), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace partiemc::client
