#include "client/evaluation/metrics/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <unordered_map>

#include "client/evaluation/metrics/logarithm.h"
#include "client/evaluation/scenes/random.h"

namespace partiemc::evaluation {
namespace {

constexpr std::size_t kResamples = 2000;
constexpr std::uint64_t kBootstrapSeed =
    20'240'117;  // Any: fixed, so that a table can be repeated.

std::vector<double> LogarithmsOf(std::span<const Pair> pairs) {
  std::vector<double> logarithms;
  for (const Pair& pair : pairs) logarithms.push_back(Logarithm(pair.Ratio()));
  return logarithms;
}

std::string NameOf(const Row& row, By by) {
  switch (by) {
    case By::kGroup:
      return std::string(Name(row.group));
    case By::kSampler:
      return row.sampler;
    case By::kSequence:
      return row.sequence;
  }
  return "";
}

}  // namespace

double Pair::Ratio() const {
  if (method == 0 && baseline == 0) return 1;
  // Products, so that a baseline of 0 needs no division.
  if (method >= kRatioLimit * baseline) return kRatioLimit;
  if (kRatioLimit * method <= baseline) return 1 / kRatioLimit;
  return method / baseline;
}

double GeometricMean(std::span<const Pair> pairs) {
  if (pairs.empty()) return kAbsent;
  double sum = 0;
  for (const double logarithm : LogarithmsOf(pairs)) sum += logarithm;
  return Exponential(sum / static_cast<double>(pairs.size()));
}

Ratio BootstrapRatio(std::span<const Pair> pairs, std::uint64_t seed) {
  if (pairs.empty()) return {};
  Random random(seed);
  const std::vector<double> logarithms = LogarithmsOf(pairs);
  std::vector<double> sums(kResamples);
  for (double& sum : sums) {
    for (std::size_t k = 0; k < pairs.size(); ++k) sum += logarithms[random.Below(pairs.size())];
  }
  std::sort(sums.begin(), sums.end());
  const auto mean = [&](double sum) {
    return Exponential(sum / static_cast<double>(pairs.size()));
  };
  return {GeometricMean(pairs), mean(sums[kResamples / 40]),
          mean(sums[kResamples - 1 - kResamples / 40])};
}

double RatioOfMeans(std::span<const Pair> pairs) {
  if (pairs.empty()) return kAbsent;
  Pair sum;
  for (const Pair& pair : pairs) {
    sum.method += pair.method;
    sum.baseline += pair.baseline;
  }
  if (sum.baseline > 0) return sum.method / sum.baseline;
  return sum.method > 0 ? std::numeric_limits<double>::infinity() : 1;
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
                             Metric metric) {
  const bool known_jitter =
      metric == Metric::kKnownHausdorffJitter || metric == Metric::kKnownMeanJitter;
  std::unordered_map<std::string_view, double> numbers;
  for (const Row& row : baseline) numbers[row.sequence] = row[metric];
  std::vector<Pair> pairs;
  for (const Row& row : method) {
    const auto found = numbers.find(row.sequence);
    if (found == numbers.end() || !row.judged) continue;
    if (std::isnan(row[metric]) || std::isnan(found->second)) continue;
    if (known_jitter && found->second <= kStillJitter) continue;
    pairs.push_back({row[metric], found->second});
  }
  return pairs;
}

Comparison CompareRows(std::span<const Row> method, std::span<const Row> baseline, Metric metric) {
  const std::vector<Pair> pairs = MatchPairs(method, baseline, metric);
  return {metric, BootstrapRatio(pairs, kBootstrapSeed), RatioOfMeans(pairs), CountVerdicts(pairs)};
}

std::vector<Part> CompareParts(std::span<const Row> method, std::span<const Row> baseline,
                               std::span<const Metric> metrics, std::size_t worst_by, By by) {
  std::vector<std::string> names;
  for (const Row& row : method) {
    const std::string name = NameOf(row, by);
    if (row.judged && !std::ranges::count(names, name)) names.push_back(name);
  }
  std::vector<Part> parts;
  for (const std::string& name : names) {
    std::vector<Row> rows;
    for (const Row& row : method) {
      if (row.judged && NameOf(row, by) == name) rows.push_back(row);
    }
    Part part{name, rows.size(), {}};
    for (const Metric metric : metrics) {
      part.ratios.push_back(CompareRows(rows, baseline, metric).ratio);
    }
    parts.push_back(std::move(part));
  }
  const auto badness = [worst_by](const Part& part) {
    const double ratio = part.ratios[worst_by].value;
    return std::isnan(ratio) ? -1 : ratio;
  };
  std::ranges::stable_sort(parts, std::ranges::greater(), badness);
  return parts;
}

}  // namespace partiemc::evaluation
