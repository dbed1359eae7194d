// Methods against a baseline: geometric means of the sequences' ratios with bootstrap intervals,
// by group, by sampler and by sequence.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/evaluation/metrics/run.h"

namespace partiemc::evaluation {

/// A sequence is a tie if the two numbers differ by less than this share of the baseline's.
inline constexpr double kTieShare = 0.01;

/// Sequences with a larger ratio are listed by name.
inline constexpr double kLossRatio = 1.25;

/// A ratio counts as no more than this and no less than one over it, so that a number that is
/// nearly 0 by accident does not decide a mean.
inline constexpr double kRatioLimit = 10;

/// Jitter of recordings is compared where the baseline has more than this, in spacings: of a body
/// at rest no ratio says anything.
inline constexpr double kStillJitter = 0.01;

/// One metric of one sequence under two methods. Neither is negative.
struct Pair {
  double method = 0, baseline = 0;

  /// Method over baseline within kRatioLimit; 1 if both are 0.
  double Ratio() const;
};

struct Ratio {
  double value = kAbsent;                ///< Geometric mean of the pairs' ratios.
  double low = kAbsent, high = kAbsent;  ///< 95 % bootstrap interval.
};

struct Verdict {
  std::size_t wins = 0, ties = 0, losses = 0;
};

/// Every pair counts alike, whatever the size of its numbers. kAbsent without pairs.
double GeometricMean(std::span<const Pair> pairs);

/// GeometricMean, and the percentiles 2.5 and 97.5 of those of 2,000 samples of the pairs, drawn
/// with replacement by xoshiro256** from `seed`. The same bits on every machine.
Ratio BootstrapRatio(std::span<const Pair> pairs, std::uint64_t seed);

/// Mean of the one over mean of the other, as the paper compares: the sequences with the largest
/// numbers decide. 1 if both are 0, infinite if only the baseline is, kAbsent without pairs.
double RatioOfMeans(std::span<const Pair> pairs);

/// Smaller wins; within kTieShare is a tie.
Verdict CountVerdicts(std::span<const Pair> pairs);

/// The numbers of sequences that both have and that are judged, in the order of `method`; of
/// kKnown... metrics only those with more than kStillJitter. Rows are matched by the sequence's
/// name; of both sides pass rows of one method and one Knowledge only.
std::vector<Pair> MatchPairs(std::span<const Row> method, std::span<const Row> baseline,
                             Metric metric);

/// One metric of one method against the baseline.
struct Comparison {
  Metric metric = Metric::kHausdorff;
  Ratio ratio;
  double ratio_of_means = kAbsent;
  Verdict verdict;
};
Comparison CompareRows(std::span<const Row> method, std::span<const Row> baseline, Metric metric);

/// What a table's rows are made of.
enum class By : std::uint8_t { kGroup, kSampler, kSequence };

struct Part {
  std::string name;           ///< Of the group, the sampler or the sequence.
  std::size_t sequences = 0;  ///< Judged ones.
  std::vector<Ratio> ratios;  ///< One for each of the metrics that were asked for.
};

/// The judged rows in parts: worst first, by the ratio of the metric `worst_by` of `metrics`
/// (an index), parts without that ratio last; of equal ones the first in `method`.
std::vector<Part> CompareParts(std::span<const Row> method, std::span<const Row> baseline,
                               std::span<const Metric> metrics, std::size_t worst_by, By by);

}  // namespace partiemc::evaluation
