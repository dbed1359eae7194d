// What a run has found: metrics for programs, pages of tables for people.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace partiemc::bench {

/// A number to be read: three significant digits, no exponent.
std::string Figure(double value);

class Report {
 public:
  using Row = std::vector<std::string>;

  /// Names are unique; units as in "ms", "MB", "ratio", "count".
  void AddMetric(const std::string& name, double value, const std::string& unit);
  /// Ends the program where there is no metric of that name.
  double Metric(const std::string& name) const;
  bool HasMetric(const std::string& name) const { return metrics_.contains(name); }

  void AddHeading(const std::string& text);
  void AddParagraph(const std::string& text);
  /// The first row is the head.
  void AddTable(const std::vector<Row>& rows);

  /// Writes bench.md and bench.csv. `opening` goes before everything else of the page.
  absl::Status Write(const std::filesystem::path& folder, const Report& opening) const;

 private:
  struct Value {
    double value;
    std::string unit;
  };
  std::map<std::string, Value> metrics_;
  std::vector<std::string> order_;  // Of the metrics.
  std::string page_;
};

}  // namespace partiemc::bench
