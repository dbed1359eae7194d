#include "client/output/statistics_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

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

constexpr std::array<std::string_view, 16> kOfSurfaces = {"frame",
                                                          "particles",
                                                          "bodies",
                                                          "cavities",
                                                          "points",
                                                          "triangles",
                                                          "genus",
                                                          "area",
                                                          "volume",
                                                          "milliseconds",
                                                          "dropped_cavities",
                                                          "dropped_components",
                                                          "dropped_spray",
                                                          "surface_digest",
                                                          "time",
                                                          "doubts"};

constexpr std::array<std::string_view, 3> kAtWalls = {"wetted_length", "contacts", "contact_angle"};

// "vertices" is the name of a count and of a stage, so the columns of stages have the suffix "_ms".
constexpr std::string_view kStageSuffix = "_ms";

constexpr std::size_t kColumnCount =
    kBeforeStages.size() + kStageCount + kAfterStages.size() + kAtWalls.size();

// The columns of outlines at walls. Outlines without walls lack the last ones (kAtWalls).
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
    next = std::copy(kAfterStages.begin(), kAfterStages.end(), next);
    std::copy(kAtWalls.begin(), kAtWalls.end(), next);
    return all;
  }();
  return columns;
}

// Appends the names of a gauge's columns.
void AppendColumns(const Gauge& gauge, std::vector<std::string>& columns) {
  const std::vector<std::string_view>& values = TraitsOf(gauge.kind).values;
  for (const std::string_view value : values) {
    columns.push_back(values.size() == 1 ? gauge.name : Concat(gauge.name, "_", value));
  }
}

double WettedLength(const Rings& rings) {
  double length = 0;
  std::size_t ring = 0;
  for (const std::uint32_t point : rings.wetted) {
    while (rings.offsets[ring + 1] <= point) ++ring;
    const std::size_t next = point + 1 < rings.offsets[ring + 1] ? point + 1 : rings.offsets[ring];
    length += std::hypot(rings.points[2 * next] - rings.points[2 * std::size_t{point}],
                         rings.points[2 * next + 1] - rings.points[2 * std::size_t{point} + 1]);
  }
  return length;
}

// In degrees; NaN without contacts.
double MeanContactAngle(const Rings& rings) {
  // The quotient below would be a NaN with a sign, "-nan".
  if (rings.contact_angles.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (const float angle : rings.contact_angles) sum += angle;
  return sum / static_cast<double>(rings.contact_angles.size()) * (180 / std::numbers::pi);
}

template <typename Values>
std::string CsvLine(const Values& values) {
  std::string line;
  for (const auto& value : values) AppendAll(line, line.empty() ? "" : ",", value);
  return line + '\n';
}

/// The values of a frame as text, in the order of the columns.
class Row {
 public:
  Row(const FrameRecord& frame, std::span<const Gauge> gauges, StatisticsOf what, bool json)
      : json_(json) {
    if (what == StatisticsOf::kSurfaces) {
      AddSurface(frame);
      return;
    }
    AddOutline(frame);
    if (what == StatisticsOf::kOutlinesAtWalls) AddWalls(frame.result.rings);
    AddGauges(frame, gauges);
  }

  std::string Csv() const { return CsvLine(values_); }

  std::string Json(std::span<const std::string> columns) const {
    std::string out = "{";
    for (std::size_t k = 0; k < columns.size(); ++k) {
      AppendAll(out, k == 0 ? "" : ",", "\"", columns[k], "\":", values_[k]);
    }
    out += '}';
    return out;
  }

 private:
  void AddOutline(const FrameRecord& frame) {
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

  void AddWalls(const Rings& rings) {
    Number(WettedLength(rings));
    Number(rings.contacts.size());
    Number(MeanContactAngle(rings));
  }

  void AddGauges(const FrameRecord& frame, std::span<const Gauge> gauges) {
    const Discs discs{frame.particles, frame.particle_areas};
    for (const Gauge& gauge : gauges) {
      for (const double value : Measure(gauge, frame.result, discs)) Number(value);
    }
  }

  void AddSurface(const FrameRecord& frame) {
    const Surface& surface = *frame.surface;
    const SurfaceTotals totals = TotalsOf(surface);
    Number(frame.index);
    Number(frame.result.statistics.particles);
    Number(totals.bodies);
    Number(totals.cavities);
    Number(surface.PointCount());
    Number(surface.TriangleCount());
    Number(totals.genus);
    Number(totals.area);
    Number(totals.volume);
    Number(frame.total_ms);
    Number(surface.statistics.dropped_cavities);
    Number(surface.statistics.dropped_components);
    Number(surface.statistics.dropped_spray);
    Digest(frame.surface_digest);
    Number(frame.time);
    Words(DoubtsText(frame.result.statistics.doubts));
  }

  template <typename Value>
  void Number(Value value) {
    std::string& text = values_.emplace_back();
    if (json_ && !std::isfinite(static_cast<double>(value))) {
      text = "null";
    } else {
      AppendNumber(text, value);
    }
  }
  void Digest(std::uint64_t value) { Words(DigestText(value)); }
  // Requires: `words` has no quote and no comma.
  void Words(const std::string& words) {
    values_.push_back(json_ ? Concat("\"", words, "\"") : words);
  }

  bool json_;
  std::vector<std::string> values_;
};

std::string ExtensionOf(const std::filesystem::path& path) {
  return absl::AsciiStrToLower(path.extension().native());
}

}  // namespace

std::span<const std::string_view> StatisticsColumns(StatisticsOf what) {
  if (what == StatisticsOf::kSurfaces) return kOfSurfaces;
  const std::span<const std::string_view> columns = Columns();
  return what == StatisticsOf::kOutlinesAtWalls ? columns
                                                : columns.first(columns.size() - kAtWalls.size());
}

absl::StatusOr<std::vector<Gauge>> ParseGauges(const std::vector<std::string>& texts,
                                               StatisticsOf what) {
  std::vector<Gauge> gauges;
  const std::span<const std::string_view> columns_of = StatisticsColumns(what);
  std::set<std::string> used(columns_of.begin(), columns_of.end());
  for (const std::string& text : texts) {
    absl::StatusOr<Gauge> gauge = ParseGauge(text);
    if (!gauge.ok()) return gauge.status();
    std::vector<std::string> columns;
    AppendColumns(*gauge, columns);
    for (const std::string& column : columns) {
      if (!used.insert(column).second) {
        return absl::InvalidArgumentError(Concat("gauge ", gauge->name,
                                                 ": the statistics already have a column '", column,
                                                 "'; choose another name"));
      }
    }
    gauges.push_back(*std::move(gauge));
  }
  return gauges;
}

StatisticsWriter::StatisticsWriter(AtomicFile file, bool json, std::vector<Gauge> gauges,
                                   StatisticsOf what)
    : file_(std::move(file)),
      json_(json),
      what_(what),
      gauges_(std::move(gauges)),
      columns_(StatisticsColumns(what).begin(), StatisticsColumns(what).end()) {
  for (const Gauge& gauge : gauges_) AppendColumns(gauge, columns_);
}

absl::Status StatisticsWriter::CheckExtension(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  if (extension == ".csv" || extension == ".json") return absl::OkStatus();
  return absl::InvalidArgumentError(Concat("stats: '", absl::Utf8SafeCHexEscape(path.native()),
                                           "' has no known extension; must end in .csv or .json"));
}

absl::StatusOr<StatisticsWriter> StatisticsWriter::Create(const std::filesystem::path& path,
                                                          std::vector<Gauge> gauges,
                                                          StatisticsOf what) {
  if (absl::Status status = CheckExtension(path); !status.ok()) return status;
  const bool json = ExtensionOf(path) == ".json";
  if (what == StatisticsOf::kSurfaces && !gauges.empty()) {
    return absl::InvalidArgumentError(
        Concat("gauge ", gauges.front().name, ": cannot measure surfaces; must be of outlines"));
  }
  absl::StatusOr<AtomicFile> file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  StatisticsWriter writer(*std::move(file), json, std::move(gauges), what);
  absl::Status status = writer.file_.Append(json ? "[" : CsvLine(writer.columns_));
  if (!status.ok()) return status;
  return writer;
}

absl::Status StatisticsWriter::Add(const FrameRecord& frame) {
  const bool is_surface = frame.surface != nullptr;
  if (is_surface != (what_ == StatisticsOf::kSurfaces)) {
    return absl::InvalidArgumentError(Concat(
        "stats: frame ", frame.index, " is ",
        is_surface ? "a surface; the file has outlines" : "an outline; the file has surfaces"));
  }
  absl::Status status = AddRow(frame);
  if (is_surface) return status;
  for (std::size_t k = 0; status.ok() && k < frame.result.sections.size(); ++k) {
    status = AddRow(SectionOf(frame, k));
  }
  return status;
}

absl::Status StatisticsWriter::AddRow(const FrameRecord& frame) {
  const Row row(frame, gauges_, what_, json_);
  const bool first = std::exchange(empty_, false);
  return file_.Append(json_ ? Concat(first ? "\n" : ",\n", row.Json(columns_)) : row.Csv());
}

absl::Status StatisticsWriter::Finish() {
  if (json_) {
    if (absl::Status status = file_.Append("\n]\n"); !status.ok()) return status;
  }
  return file_.Commit();
}

}  // namespace partiemc::client
