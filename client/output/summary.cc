#include "client/output/summary.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include "absl/strings/str_format.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

double Mean(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double Percentile(std::vector<double> values, double percent) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * count));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

/// A number with commas: 1,234,567.8.
std::string Grouped(double value, int decimals) {
  std::string text = absl::StrFormat("%.*f", decimals, value);
  std::size_t end = text.find('.');
  if (end == std::string::npos) end = text.size();
  while (end > 3 && std::isdigit(static_cast<unsigned char>(text[end - 4]))) {
    end -= 3;
    text.insert(end, 1, ',');
  }
  return text;
}

SummaryRow Row(std::string_view label, const std::vector<double>& values, int mean_decimals,
               int decimals, std::string_view unit = "") {
  return {std::string(label), Concat(Grouped(Mean(values), mean_decimals), unit),
          Concat(Grouped(Percentile(values, 50), decimals), unit),
          Concat(Grouped(Percentile(values, 99), decimals), unit)};
}

}  // namespace

void Summary::Add(const FrameRecord& frame) {
  total_ms_.push_back(frame.total_ms);
  for (std::size_t k = 0; k < kAllDoubts.size(); ++k) {
    if (frame.result.statistics.doubts.Has(kAllDoubts[k])) ++doubted_[k];
  }
  if (!frame.surface) return AddOutline(frame);
  const SurfaceTotals totals = TotalsOf(*frame.surface);
  particles_.push_back(static_cast<double>(frame.result.statistics.particles));
  bodies_.push_back(static_cast<double>(totals.bodies));
  cavities_.push_back(static_cast<double>(totals.cavities));
  vertices_.push_back(static_cast<double>(frame.surface->PointCount()));
  triangles_.push_back(static_cast<double>(frame.surface->TriangleCount()));
}

void Summary::AddOutline(const FrameRecord& frame) {
  const FrameStatistics& statistics = frame.result.statistics;
  const auto grid = static_cast<double>(statistics.triangles_grid);
  const auto triangles = static_cast<double>(statistics.triangles);
  particles_.push_back(static_cast<double>(statistics.particles));
  rings_.push_back(static_cast<double>(frame.result.rings.RingCount()));
  vertices_.push_back(static_cast<double>(frame.result.rings.PointCount()));
  triangles_grid_.push_back(grid);
  triangles_.push_back(triangles);
  if (grid > 0) reduction_.push_back(100 * (1 - triangles / grid));
  for (std::size_t k = 0; k < kStageCount; ++k) stages_ms_[k].push_back(frame.stages_ms[k]);
  self_intersections_ += statistics.self_intersections;
  folded_triangles_ += statistics.folded_triangles;
}

std::vector<std::string> Summary::Warnings() const {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < kAllDoubts.size(); ++k) {
    if (doubted_[k] == 0) continue;
    warnings.push_back(Concat("doubt in ", doubted_[k], " of ", Plural(frame_count(), "frame"),
                              ": ", Name(kAllDoubts[k]), ": ", Explanation(kAllDoubts[k])));
  }
  return warnings;
}

bool Summary::is_empty() const {
  const auto is_zero = [](double count) { return count == 0; };
  return !std::ranges::all_of(particles_, is_zero) && std::ranges::all_of(rings_, is_zero) &&
         std::ranges::all_of(bodies_, is_zero);
}

double Summary::MeanReductionPercent() const { return Mean(reduction_); }

std::vector<SummaryRow> Summary::SurfaceRows() const {
  return {
      Row("particles", particles_, 1, 0), Row("bodies", bodies_, 1, 0),
      Row("cavities", cavities_, 1, 0),   Row("points", vertices_, 1, 0),
      Row("triangles", triangles_, 1, 0), Row("milliseconds", total_ms_, 3, 3),
  };
}

std::vector<SummaryRow> Summary::Rows() const {
  if (!bodies_.empty()) return SurfaceRows();
  std::vector<SummaryRow> rows = {
      Row("particles", particles_, 1, 0),
      Row("rings", rings_, 1, 0),
      Row("vertices", vertices_, 1, 0),
      Row("triangles unmerged", triangles_grid_, 1, 0),
      Row("triangles merged", triangles_, 1, 0),
      Row("reduction", reduction_, 1, 1, " %"),
      {"milliseconds", "", "", ""},
  };
  for (std::size_t k = 0; k < kStageCount; ++k) {
    rows.push_back(Row(Concat("  ", kStageNames[k]), stages_ms_[k], 3, 3));
  }
  rows.push_back(Row("  whole frame", total_ms_, 3, 3));
  return rows;
}

std::string Summary::Headline(double wall_seconds) const {
  std::string line = Concat(Grouped(static_cast<double>(frame_count()), 0),
                            frame_count() == 1 ? " frame" : " frames");
  if (refused_ > 0) AppendAll(line, " (and ", refused_, " refused)");
  AppendAll(line, " in ", Grouped(wall_seconds, wall_seconds < 10 ? 2 : 1), " s");
  if (wall_seconds > 0) {
    AppendAll(line, ", ", Grouped(static_cast<double>(frame_count()) / wall_seconds, 1),
              " frames per second");
  }
  if (!ended_early_.empty()) AppendAll(line, "; ended early: ", ended_early_);
  if (self_intersections_ > 0) {
    AppendAll(line, "; self-intersections: ", self_intersections_);
  }
  if (folded_triangles_ > 0) AppendAll(line, "; folded triangles: ", folded_triangles_);
  return line;
}

std::string Summary::Table(double wall_seconds) const {
  std::vector<SummaryRow> rows = Rows();
  rows.insert(rows.begin(), {"", "mean", "p50", "p99"});
  std::array<std::size_t, 4> widths = {};
  for (const SummaryRow& row : rows) {
    widths[0] = std::max(widths[0], row.label.size());
    widths[1] = std::max(widths[1], row.mean.size());
    widths[2] = std::max(widths[2], row.p50.size());
    widths[3] = std::max(widths[3], row.p99.size());
  }
  std::string table = Concat(Headline(wall_seconds), "\n");
  for (const SummaryRow& row : rows) {
    std::string line = absl::StrFormat("%-*s  %*s  %*s  %*s", widths[0], row.label, widths[1],
                                       row.mean, widths[2], row.p50, widths[3], row.p99);
    line.erase(line.find_last_not_of(' ') + 1);
    AppendAll(table, line, "\n");
  }
  return table;
}

}  // namespace partiemc::client
