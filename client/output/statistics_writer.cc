#include "client/output/statistics_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

constexpr std::array<std::string_view, 8> kBeforeStages = {
    "frame",          "particles", "polylines", "vertices",
    "triangles_grid", "triangles", "area",      "milliseconds"};
constexpr std::array<std::string_view, 11> kAfterStages = {"perimeter",
                                                           "self_intersections",
                                                           "folded_triangles",
                                                           "dropped_holes",
                                                           "dropped_components",
                                                           "dropped_spray",
                                                           "rings_digest",
                                                           "mesh_digest",
                                                           "time",
                                                           "doubts",
                                                           "section"};
constexpr std::size_t kColumnCount = kBeforeStages.size() + kStageCount + kAfterStages.size();

// "vertices" is a count and a stage, so stages have the suffix "_ms".
constexpr std::string_view kStageSuffix = "_ms";

const std::array<std::string_view, kColumnCount>& Columns() {
  static const std::array<std::string, kStageCount> stages = [] {
    std::array<std::string, kStageCount> names;
    for (std::size_t k = 0; k < kStageCount; ++k) names[k] = Concat(kStageNames[k], kStageSuffix);
    return names;
  }();
  static const auto columns = [] {
    std::array<std::string_view, kColumnCount> all;
    auto next = std::copy(kBeforeStages.begin(), kBeforeStages.end(), all.begin());
    next = std::copy(stages.begin(), stages.end(), next);
    std::copy(kAfterStages.begin(), kAfterStages.end(), next);
    return all;
  }();
  return columns;
}

/// A line of CSV.
template <typename Values>
std::string CsvLine(const Values& values) {
  std::string line;
  for (const auto& value : values) AppendAll(line, line.empty() ? "" : ",", value);
  return line + '\n';
}

/// The values of a frame as text, in the order of the columns.
class Row {
 public:
  Row(const FrameRecord& frame, bool json) : json_(json) {
    const FrameStatistics& statistics = frame.result.statistics;
    Number(frame.index);
    Number(statistics.particles);
    Number(frame.result.rings.RingCount());
    Number(frame.result.rings.PointCount());
    Number(statistics.triangles_grid);
    Number(statistics.triangles);
    Number(statistics.area);
    Number(frame.total_ms);
    for (const double stage_ms : frame.stages_ms) Number(stage_ms);
    Number(statistics.perimeter);
    Number(statistics.self_intersections);
    Number(statistics.folded_triangles);
    Number(statistics.dropped_holes);
    Number(statistics.dropped_components);
    Number(statistics.dropped_spray);
    Digest(frame.rings_digest);
    Digest(frame.mesh_digest);
    Number(frame.time);
    Words(DoubtsText(statistics.doubts));
    Number(frame.section);
  }

  std::string Csv() const { return CsvLine(values_); }

  std::string Json() const {
    std::string out = "{";
    for (std::size_t k = 0; k < kColumnCount; ++k) {
      AppendAll(out, k == 0 ? "" : ",", "\"", Columns()[k], "\":", values_[k]);
    }
    out += '}';
    return out;
  }

 private:
  template <typename Value>
  void Number(Value value) {
    std::string& text = values_[next_++];
    if (json_ && !std::isfinite(static_cast<double>(value))) {
      text = "null";
    } else {
      AppendNumber(text, value);
    }
  }
  void Digest(std::uint64_t value) { Words(DigestText(value)); }
  // Has no quote and no comma.
  void Words(const std::string& words) {
    values_[next_++] = json_ ? Concat("\"", words, "\"") : words;
  }

  bool json_;
  std::array<std::string, kColumnCount> values_;
  std::size_t next_ = 0;
};

}  // namespace

std::span<const std::string_view> StatisticsColumns() { return Columns(); }

absl::StatusOr<StatisticsWriter> StatisticsWriter::Create(const std::filesystem::path& path) {
  const std::string extension = absl::AsciiStrToLower(path.extension().native());
  const bool json = extension == ".json";
  if (!json && extension != ".csv") {
    return absl::InvalidArgumentError(
        Concat("stats: '", absl::Utf8SafeCHexEscape(path.native()),
               "' has no known extension; must end in .csv or .json"));
  }
  absl::StatusOr<AtomicFile> file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  StatisticsWriter writer(*std::move(file), json);
  absl::Status status = writer.file_.Append(json ? "[" : CsvLine(Columns()));
  if (!status.ok()) return status;
  return writer;
}

absl::Status StatisticsWriter::Add(const FrameRecord& frame) {
  absl::Status status = AddRow(frame);
  for (std::size_t k = 0; status.ok() && k < frame.result.sections.size(); ++k) {
    status = AddRow(SectionOf(frame, k));
  }
  return status;
}

absl::Status StatisticsWriter::AddRow(const FrameRecord& frame) {
  const Row row(frame, json_);
  const bool first = std::exchange(empty_, false);
  return file_.Append(json_ ? Concat(first ? "\n" : ",\n", row.Json()) : row.Csv());
}

absl::Status StatisticsWriter::Finish() {
  if (json_) {
    if (absl::Status status = file_.Append("\n]\n"); !status.ok()) return status;
  }
  return file_.Commit();
}

}  // namespace partiemc::client
