// Ratios, intervals and verdicts on numbers made by hand.
#include "client/evaluation/metrics/compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "client/evaluation/metrics/logarithm.h"

namespace partiemc::evaluation {
namespace {

Row RowOf(const std::string& sequence, Group group, double hausdorff) {
  Row row;
  row.sequence = sequence;
  row.group = group;
  row.values.fill(kAbsent);
  row.values[static_cast<std::size_t>(Metric::kHausdorff)] = hausdorff;
  return row;
}

TEST(Compare, TakesTheGeometricMeanOfTheSequencesRatios) {
  // Ratios 1/2, 2 and 1/8: their product is 1/8.
  const std::vector<Pair> pairs = {{1, 2}, {200, 100}, {0.125, 1}};
  EXPECT_NEAR(GeometricMean(pairs), 0.5, 1e-15);
  EXPECT_DOUBLE_EQ(RatioOfMeans(pairs), 201.125 / 103);
}

TEST(Compare, LimitsRatiosThatAnAccidentMadeHuge) {
  EXPECT_NEAR(GeometricMean(std::vector<Pair>{{1, 1e-9}, {1e-9, 1}}), 1, 1e-15);
  EXPECT_NEAR(GeometricMean(std::vector<Pair>{{1, 0}}), kRatioLimit, 1e-12);
  EXPECT_NEAR(GeometricMean(std::vector<Pair>{{0, 1}, {0, 0}}), std::sqrt(0.1), 1e-15);
}

TEST(Compare, KnowsWhatNothingDividedByNothingIs) {
  EXPECT_EQ(RatioOfMeans(std::vector<Pair>{{0, 0}}), 1);
  EXPECT_TRUE(std::isinf(RatioOfMeans(std::vector<Pair>{{1, 0}})));
  EXPECT_TRUE(std::isnan(RatioOfMeans({})));
  EXPECT_TRUE(std::isnan(GeometricMean({})));
}

TEST(Compare, BootstrapsAConstantRatioToAPoint) {
  const std::vector<Pair> pairs = {{0.5, 1}, {1, 2}, {2, 4}};
  const Ratio ratio = BootstrapRatio(pairs, 1);
  EXPECT_NEAR(ratio.value, 0.5, 1e-15);
  EXPECT_NEAR(ratio.low, 0.5, 1e-15);
  EXPECT_NEAR(ratio.high, 0.5, 1e-15);
}

TEST(Compare, BootstrapsAnIntervalAsWideAsTheoryExpects) {
  // Ratios of 100 sequences, half of them 1/2 and half 2: logarithms with deviation ln 2, the mean
  // of 100 with ln 2 / 10.
  std::vector<Pair> pairs;
  for (int k = 0; k < 100; ++k) pairs.push_back({k % 2 == 0 ? 0.5 : 2, 1});
  const Ratio ratio = BootstrapRatio(pairs, 5);
  const double reach = std::exp(1.96 * std::log(2) / 10);
  EXPECT_NEAR(ratio.value, 1, 1e-14);
  EXPECT_NEAR(ratio.low, 1 / reach, 0.015);
  EXPECT_NEAR(ratio.high, reach, 0.015);
  EXPECT_EQ(BootstrapRatio(pairs, 5).low, ratio.low);
}

TEST(Compare, BootstrapOfTwoSequencesIsWhatCanBeListed) {
  // Four samples with replacement: 1/4, 1 twice, 4. The outer ones are a quarter of all each.
  const Ratio ratio = BootstrapRatio(std::vector<Pair>{{1, 4}, {4, 1}}, 3);
  EXPECT_NEAR(ratio.value, 1, 1e-15);
  EXPECT_NEAR(ratio.low, 0.25, 1e-15);
  EXPECT_NEAR(ratio.high, 4, 1e-14);
}

TEST(Logarithm, AndExponentialAgreeWithTheLibraryToTheirBounds) {
  for (double x = 1e-6; x < 1e6; x *= 1.37) {
    EXPECT_NEAR(Logarithm(x), std::log(x), 1e-15 * std::max(1.0, std::abs(std::log(x)))) << x;
    EXPECT_NEAR(Exponential(Logarithm(x)) / x, 1, 1e-14) << x;
  }
  EXPECT_EQ(Logarithm(1), 0);
  EXPECT_EQ(Exponential(0), 1);
}

TEST(Compare, CallsOnePercentATie) {
  const std::vector<Pair> pairs = {{0.98, 1}, {0.995, 1}, {1.005, 1}, {1.02, 1}, {0, 0}};
  const Verdict verdict = CountVerdicts(pairs);
  EXPECT_EQ(verdict.wins, 1u);
  EXPECT_EQ(verdict.ties, 3u);
  EXPECT_EQ(verdict.losses, 1u);
}

TEST(Compare, MatchesByNameAndLeavesOutWhatIsNotJudgedOrAbsent) {
  std::vector<Row> method = {RowOf("a", Group::kRigid, 1), RowOf("b", Group::kNoise, 3),
                             RowOf("c", Group::kNoise, kAbsent), RowOf("d", Group::kNoise, 9),
                             RowOf("e", Group::kNoise, 9)};
  method[3].judged = false;
  const std::vector<Row> baseline = {RowOf("b", Group::kNoise, 2), RowOf("a", Group::kRigid, 2),
                                     RowOf("c", Group::kNoise, 1), RowOf("d", Group::kNoise, 1)};
  const Comparison comparison = CompareRows(method, baseline, Metric::kHausdorff);
  // a: 1/2, b: 3/2.
  EXPECT_NEAR(comparison.ratio.value, std::sqrt(0.75), 1e-15);
  EXPECT_DOUBLE_EQ(comparison.ratio_of_means, 1);
  EXPECT_EQ(comparison.verdict.wins, 1u);
  EXPECT_EQ(comparison.verdict.losses, 1u);
}

TEST(Compare, LeavesOutKnownJitterWhereTheBaselineHasNone) {
  const auto jitter = [](const std::string& sequence, double value) {
    Row row = RowOf(sequence, Group::kRecording, kAbsent);
    row.values[static_cast<std::size_t>(Metric::kKnownMeanJitter)] = value;
    return row;
  };
  const std::vector<Row> method = {jitter("still", 0.02), jitter("moves", 0.02)};
  const std::vector<Row> baseline = {jitter("still", kStillJitter), jitter("moves", 0.04)};
  const auto pairs = MatchPairs(method, baseline, Metric::kKnownMeanJitter);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].baseline, 0.04);
}

TEST(Compare, PutsTheWorstPartFirst) {
  std::vector<Row> method = {RowOf("a", Group::kRigid, 1), RowOf("b", Group::kNoise, 3),
                             RowOf("c", Group::kNoise, 12), RowOf("d", Group::kGrowth, 2),
                             RowOf("e", Group::kRagged, kAbsent)};
  for (Row& row : method) row.sampler = row.sequence < "c" ? "hexagonal" : "clumped";
  std::vector<Row> baseline = method;
  for (Row& row : baseline) row.values.fill(2);
  constexpr std::array kMetrics = {Metric::kMeanJitter, Metric::kHausdorff};
  const auto groups = CompareParts(method, baseline, kMetrics, 1, By::kGroup);
  ASSERT_EQ(groups.size(), 4u);
  EXPECT_EQ(groups[0].name, "noise");
  EXPECT_EQ(groups[0].sequences, 2u);
  EXPECT_NEAR(groups[0].ratios[1].value, 3, 1e-14);
  EXPECT_TRUE(std::isnan(groups[0].ratios[0].value));
  EXPECT_EQ(groups[1].name, "growth");
  EXPECT_EQ(groups[2].name, "rigid");
  EXPECT_EQ(groups[3].name, "ragged") << "without the metric";
  const auto samplers = CompareParts(method, baseline, kMetrics, 1, By::kSampler);
  ASSERT_EQ(samplers.size(), 2u);
  EXPECT_EQ(samplers[0].name, "clumped");
  EXPECT_NEAR(samplers[0].ratios[1].value, std::sqrt(6), 1e-14);
  EXPECT_NEAR(samplers[1].ratios[1].value, std::sqrt(0.75), 1e-14);
  EXPECT_EQ(CompareParts(method, baseline, kMetrics, 1, By::kSequence)[0].name, "c");
}

}  // namespace
}  // namespace partiemc::evaluation
