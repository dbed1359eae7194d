// Medians and percentiles of what was measured.
#pragma once

#include <utility>
#include <vector>

namespace partiemc::bench {

/// The value below which `percent` of the values lie, linear between neighbours in order.
/// Requires: values not empty, percent in [0, 100].
double Percentile(std::vector<double> values, double percent);

inline double Median(std::vector<double> values) { return Percentile(std::move(values), 50); }

}  // namespace partiemc::bench
