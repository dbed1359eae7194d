#include "client/cli/load/latencies.h"

#include <algorithm>
#include <cmath>

namespace partiemc::client {
namespace {

constexpr double kTolerance = 0.05, kLeastDifference = 0.2;

bool AreAlike(double a, double b) {
  return std::abs(a - b) <= std::max(kTolerance * std::max(a, b), kLeastDifference);
}

}  // namespace

Percentiles PercentilesOf(std::vector<double>& times) {
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(times.size()));
    return times[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
  };
  return {times.size(), at(0.5), at(0.9), at(0.99), times.back()};
}

bool HaveSettled(const Percentiles& before, const Percentiles& after) {
  return before.count > 0 && after.count > 0 && AreAlike(before.p50, after.p50) &&
         AreAlike(before.p99, after.p99);
}

}  // namespace partiemc::client
