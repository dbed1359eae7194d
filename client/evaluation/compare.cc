#include "evaluation/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <unordered_map>

#include "evaluation/random.h"

namespace partiemc::evaluation {
namespace {

constexpr std::size_t kResamples = 2000;
constexpr std::uint64_t kBootstrapSeed =
    20'240'117;  // Any: fixed, so that a table can be repeated.

// Sums of the two sides. Their ratio is that of the means.
double RatioOfSums(double method, double baseline) {
  if (baseline > 0) return method / baseline;
  return method > 0 ? std::numeric_limits<double>::infinity() : 1;
}

Pair MeansOf(std::span<const Pair> pairs) {
  Pair sum;
  for (const Pair& pair : pairs) {
    sum.method += pair.method;
    sum.baseline += pair.baseline;
  }
  const auto count = static_cast<double>(pairs.size());
  return {sum.method / count, sum.baseline / count};
}

}  // namespace

double RatioOfMeans(std::span<const Pair> pairs) {
  if (pairs.empty()) return kAbsent;
  const Pair means = MeansOf(pairs);
  return RatioOfSums(means.method, means.baseline);
}

Ratio BootstrapRatio(std::span<const Pair> pairs, std::uint64_t seed) {
  Ratio ratio{RatioOfMeans(pairs), kAbsent, kAbsent};
  if (pairs.empty()) return ratio;
  Random random(seed);
  std::vector<double> ratios(kResamples);
  for (double& resampled : ratios) {
    Pair sum;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Pair& pair = pairs[random.Below(pairs.size())];
      sum.method += pair.method;
      sum.baseline += pair.baseline;
    }
    resampled = RatioOfSums(sum.method, sum.baseline);
  }
  std::sort(ratios.begin(), ratios.end());
  ratio.low = ratios[kResamples / 40];
  ratio.high = ratios[kResamples - 1 - kResamples / 40];
  return ratio;
}

Verdict CountVerdicts(std::span<const Pair> pairs) {
  Verdict verdict;
  for (const Pair& pair : pairs) {
    const double margin = kTieShare * pair.baseline;
    if (pair.method < pair.baseline - margin) {
      ++verdict.wins;
    } else if (pair.method > pair.baseline + margin) {
      ++verdict.losses;
    } else {
      ++verdict.ties;
    }
  }
  return verdict;
}

std::vector<Pair> MatchPairs(std::span<const Row> method, std::span<const Row> baseline,
                             Metric metric, std::optional<Group> group) {
  std::unordered_map<std::string_view, double> numbers;
  for (const Row& row : baseline) numbers[row.sequence] = row[metric];
  std::vector<Pair> pairs;
  for (const Row& row : method) {
    const auto found = numbers.find(row.sequence);
    if (found == numbers.end() || !row.judged || (group && row.group != *group)) continue;
    if (std::isnan(row[metric]) || std::isnan(found->second)) continue;
    pairs.push_back({row[metric], found->second});
  }
  return pairs;
}

Comparison CompareRows(std::span<const Row> method, std::span<const Row> baseline, Metric metric) {
  Comparison comparison;
  comparison.metric = metric;
  const std::vector<Pair> pairs = MatchPairs(method, baseline, metric);
  if (!pairs.empty()) {
    const Pair means = MeansOf(pairs);
    comparison.method_mean = means.method;
    comparison.baseline_mean = means.baseline;
  }
  comparison.ratio = BootstrapRatio(pairs, kBootstrapSeed);
  comparison.verdict = CountVerdicts(pairs);
  for (std::size_t group = 0; group < kGroupCount; ++group) {
    comparison.group_ratios[group] =
        RatioOfMeans(MatchPairs(method, baseline, metric, static_cast<Group>(group)));
  }
  return comparison;
}

}  // namespace partiemc::evaluation
