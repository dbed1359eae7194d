// Methods against a baseline: ratios of means with bootstrap intervals, wins and losses.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "evaluation/run.h"

namespace partiemc::evaluation {

/// A sequence is a tie if the two numbers differ by less than this share of the baseline's.
inline constexpr double kTieShare = 0.01;

/// A group loses a metric if its ratio is above this.
inline constexpr double kGroupLossRatio = 1.05;

/// One metric of one sequence under two methods.
struct Pair {
  double method = 0, baseline = 0;
};

struct Ratio {
  double value = kAbsent;                ///< Mean of the method over mean of the baseline.
  double low = kAbsent, high = kAbsent;  ///< 95 % bootstrap interval.
};

struct Verdict {
  std::size_t wins = 0, ties = 0, losses = 0;
};

/// Mean of the one over mean of the other. 1 if both are 0, infinite if only the baseline is,
/// kAbsent without pairs.
double RatioOfMeans(std::span<const Pair> pairs);

/// RatioOfMeans, and the percentiles 2.5 and 97.5 of the ratios of 2,000 samples of the pairs,
/// drawn with replacement by xoshiro256** from `seed`.
Ratio BootstrapRatio(std::span<const Pair> pairs, std::uint64_t seed);

/// Smaller wins; within kTieShare is a tie.
Verdict CountVerdicts(std::span<const Pair> pairs);

/// One metric of one method against the baseline.
struct Comparison {
  Metric metric = Metric::kHausdorff;
  double method_mean = kAbsent, baseline_mean = kAbsent;
  Ratio ratio;
  Verdict verdict;
  std::array<double, kGroupCount> group_ratios;  ///< By Group; kAbsent where it has no sequences.

  bool GroupLoses(Group group) const {
    return group_ratios[static_cast<std::size_t>(group)] > kGroupLossRatio;
  }
};

/// The numbers of sequences that both have and that are judged, in the order of `method`; only of
/// one group if one is given. Rows are matched by the sequence's name; of both sides pass rows of
/// one method and one Knowledge only.
std::vector<Pair> MatchPairs(std::span<const Row> method, std::span<const Row> baseline,
                             Metric metric, std::optional<Group> group = std::nullopt);

Comparison CompareRows(std::span<const Row> method, std::span<const Row> baseline, Metric metric);

}  // namespace partiemc::evaluation
