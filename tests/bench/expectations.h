// Recorded ratios, so that a change that makes something twice as slow is seen without anybody
// reading tables. Never times: those belong to a machine.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bench/report.h"

namespace partiemc::bench {

struct Expectation {
  std::string metric;
  double value = 0;  ///< As recorded.
  bool lower_is_better = false;
  double margin = 1;  ///< How many times worse is still noise.

  /// The worst value that passes.
  double Limit() const { return lower_is_better ? value * margin : value / margin; }
};

/// Reads lines of `metric,value,better,margin` after a head; `#` begins a comment.
/// Errors: NOT_FOUND, INVALID_ARGUMENT naming the line.
absl::StatusOr<std::vector<Expectation>> ReadExpectations(const std::string& path);

/// One line for each metric that is worse than its limit, or that was not measured.
std::vector<std::string> Failures(const std::vector<Expectation>& expectations,
                                  const Report& report);

/// Writes the report's values into the file; comments, order, directions and margins stay.
absl::Status RefreshExpectations(const std::string& path, const Report& report);

}  // namespace partiemc::bench
