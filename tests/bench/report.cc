#include "bench/report.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "bench/progress.h"

namespace partiemc::bench {
namespace {

absl::Status WriteFile(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  return file.good() ? absl::OkStatus()
                     : absl::UnavailableError(absl::StrCat("cannot write ", path.string()));
}

}  // namespace

std::string Figure(double value) {
  const double size = std::abs(value);
  const int whole = size >= 1 ? static_cast<int>(std::floor(std::log10(size))) : 0;
  // Below 0.001 nothing is measured here that anybody would act upon.
  return absl::StrFormat("%.*f", size == 0 ? 0 : size < 0.1 ? 3 : std::max(0, 2 - whole), value);
}

void Report::AddMetric(const std::string& name, double value, const std::string& unit) {
  if (metrics_.emplace(name, Value{value, unit}).second) order_.push_back(name);
}

double Report::Metric(const std::string& name) const {
  const auto found = metrics_.find(name);
  if (found == metrics_.end()) Fail("nothing has measured " + name);
  return found->second.value;
}

void Report::AddHeading(const std::string& text) { absl::StrAppend(&page_, "## ", text, "\n\n"); }

void Report::AddParagraph(const std::string& text) { absl::StrAppend(&page_, text, "\n\n"); }

void Report::AddTable(const std::vector<Row>& rows) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    absl::StrAppend(&page_, "| ", absl::StrJoin(rows[k], " | "), " |\n");
    if (k > 0) continue;
    page_ += "|";
    for (std::size_t column = 0; column < rows[0].size(); ++column) page_ += "---|";
    page_ += "\n";
  }
  page_ += "\n";
}

absl::Status Report::Write(const std::filesystem::path& folder, const Report& opening) const {
  std::error_code ignored;  // Writing says it, if the folder is not there.
  std::filesystem::create_directories(folder, ignored);
  std::string csv = "metric,value,unit\n";
  for (const std::string& name : order_) {
    const Value& metric = metrics_.at(name);
    absl::StrAppend(&csv, name, ",", absl::StrFormat("%.6g", metric.value), ",", metric.unit, "\n");
  }
  if (auto status = WriteFile(folder / "bench.csv", csv); !status.ok()) return status;
  return WriteFile(folder / "bench.md", opening.page_ + page_);
}

}  // namespace partiemc::bench
