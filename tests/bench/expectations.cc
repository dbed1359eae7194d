#include "bench/expectations.h"

#include <fstream>
#include <optional>
#include <string_view>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace partiemc::bench {
namespace {

constexpr char kHead[] = "metric,value,better,margin";

bool IsRow(std::string_view line) { return !line.empty() && line[0] != '#' && line != kHead; }

std::optional<Expectation> ParseRow(const std::string& line) {
  const std::vector<std::string> cells = absl::StrSplit(line, ',');
  Expectation row;
  if (cells.size() != 4 || !absl::SimpleAtod(cells[1], &row.value) ||
      !absl::SimpleAtod(cells[3], &row.margin) || !(row.value >= 0) || !(row.margin >= 1) ||
      (cells[2] != "lower" && cells[2] != "higher")) {
    return std::nullopt;
  }
  row.metric = cells[0];
  row.lower_is_better = cells[2] == "lower";
  return row;
}

absl::StatusOr<std::vector<std::string>> ReadLines(const std::string& path) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

}  // namespace

absl::StatusOr<std::vector<Expectation>> ReadExpectations(const std::string& path) {
  const auto lines = ReadLines(path);
  if (!lines.ok()) return lines.status();
  std::vector<Expectation> expectations;
  for (const std::string& line : *lines) {
    if (!IsRow(line)) continue;
    const auto row = ParseRow(line);
    if (!row) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": \"", line, "\" is not ", kHead, " with lower or higher"));
    }
    expectations.push_back(*row);
  }
  if (expectations.empty()) return absl::InvalidArgumentError(absl::StrCat(path, ": is empty"));
  return expectations;
}

std::vector<std::string> Failures(const std::vector<Expectation>& expectations,
                                  const Report& report) {
  std::vector<std::string> failures;
  for (const Expectation& expected : expectations) {
    if (!report.HasMetric(expected.metric)) {
      failures.push_back(absl::StrCat(expected.metric, " was not measured"));
      continue;
    }
    const double value = report.Metric(expected.metric);
    // So written that a NaN fails.
    const bool passes =
        expected.lower_is_better ? value <= expected.Limit() : value >= expected.Limit();
    if (!passes) {
      failures.push_back(absl::StrCat(expected.metric, " is ", Figure(value), ", recorded ",
                                      Figure(expected.value), ", allowed at ",
                                      expected.lower_is_better ? "most " : "least ",
                                      Figure(expected.Limit())));
    }
  }
  return failures;
}

absl::Status RefreshExpectations(const std::string& path, const Report& report) {
  auto lines = ReadLines(path);
  if (!lines.ok()) return lines.status();
  for (std::string& line : *lines) {
    if (!IsRow(line)) continue;
    const auto row = ParseRow(line);
    if (!row || !report.HasMetric(row->metric)) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": no value for \"", line, "\""));
    }
    line = absl::StrFormat("%s,%.3g,%s,%g", row->metric, report.Metric(row->metric),
                           row->lower_is_better ? "lower" : "higher", row->margin);
  }
  std::ofstream file(path);
  file << absl::StrJoin(*lines, "\n") << "\n";
  file.close();
  return file.good() ? absl::OkStatus()
                     : absl::UnavailableError(absl::StrCat("cannot write ", path));
}

}  // namespace partiemc::bench
