// Ratios, intervals and verdicts on numbers made by hand.
#include "evaluation/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

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

TEST(Compare, DividesMeansAndNotSequences) {
  const std::vector<Pair> pairs = {{1, 1}, {1, 4}};
  EXPECT_DOUBLE_EQ(RatioOfMeans(pairs), 2.0 / 5.0);
}

TEST(Compare, KnowsWhatNothingDividedByNothingIs) {
  EXPECT_EQ(RatioOfMeans(std::vector<Pair>{{0, 0}}), 1);
  EXPECT_TRUE(std::isinf(RatioOfMeans(std::vector<Pair>{{1, 0}})));
  EXPECT_TRUE(std::isnan(RatioOfMeans({})));
}

TEST(Compare, BootstrapsAConstantRatioToAPoint) {
  const std::vector<Pair> pairs = {{0.5, 1}, {1, 2}, {2, 4}};
  const Ratio ratio = BootstrapRatio(pairs, 1);
  EXPECT_DOUBLE_EQ(ratio.value, 0.5);
  EXPECT_DOUBLE_EQ(ratio.low, 0.5);
  EXPECT_DOUBLE_EQ(ratio.high, 0.5);
}

TEST(Compare, BootstrapsAnIntervalAsWideAsTheoryExpects) {
  // Ratios of 100 sequences with equal baselines: the mean of numbers with deviation 1/2.
  std::vector<Pair> pairs;
  for (int k = 0; k < 100; ++k) pairs.push_back({k % 2 == 0 ? 0.5 : 1.5, 1});
  const Ratio ratio = BootstrapRatio(pairs, 5);
  EXPECT_DOUBLE_EQ(ratio.value, 1);
  EXPECT_NEAR(ratio.low, 1 - 1.96 * 0.05, 0.012);
  EXPECT_NEAR(ratio.high, 1 + 1.96 * 0.05, 0.012);
  EXPECT_EQ(BootstrapRatio(pairs, 5).low, ratio.low);
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
  EXPECT_DOUBLE_EQ(comparison.ratio.value, 1);
  EXPECT_DOUBLE_EQ(comparison.method_mean, 2);
  EXPECT_EQ(comparison.verdict.wins, 1u);
  EXPECT_EQ(comparison.verdict.losses, 1u);
  EXPECT_DOUBLE_EQ(comparison.group_ratios[static_cast<std::size_t>(Group::kNoise)], 1.5);
  EXPECT_TRUE(comparison.GroupLoses(Group::kNoise));
  EXPECT_FALSE(comparison.GroupLoses(Group::kRigid));
  EXPECT_FALSE(comparison.GroupLoses(Group::kGrowth));
}

}  // namespace
}  // namespace partiemc::evaluation
