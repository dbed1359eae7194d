#include "client/output/report.h"

#include <charconv>
#include <cmath>
#include <functional>
#include <span>
#include <string_view>

#include "absl/strings/escaping.h"
#include "client/output/color_map.h"
#include "client/output/html.h"
#include "client/output/report_geometry.h"
#include "client/output/report_surface.h"
#include "client/output/text.h"
#include "partiemc/status.h"

namespace partiemc::client {

// report_page.html and report_space.txt, embedded by embed.cmake.
namespace page {
extern const std::string_view kReportPageHtml;
extern const std::string_view kReportSpaceTxt;
}  // namespace page

namespace {

constexpr std::string_view kFramesMark = "{{frames}}";

// Significant digits of a displayed number.
constexpr int kShownDigits = 7;

// Rings below this share of the largest area do not extend the initial view. Otherwise spray that
// has left the scene would shrink everything else to a dot.
constexpr double kMinorShare = 0.01;

/// Replaces every {{name}} of `text` by value(name). Values are not expanded.
std::string Expand(std::string_view text,
                   const std::function<std::string(std::string_view)>& value) {
  std::string out;
  while (true) {
    const std::size_t begin = text.find("{{");
    const std::size_t end = text.find("}}", begin);
    if (begin == std::string_view::npos || end == std::string_view::npos) break;
    AppendAll(out, text.substr(0, begin), value(text.substr(begin + 2, end - begin - 2)));
    text.remove_prefix(end + 2);
  }
  return Concat(out, text);
}

void AppendShown(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  char buffer[32];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value,
                                   std::chars_format::general, kShownDigits)
                         .ptr);
}

void AppendBox(std::string& out, const Box& box) {
  if (box.Empty()) {
    out += "null";
    return;
  }
  out += '[';
  AppendNumber(out, box.min_x);
  out += ',';
  AppendNumber(out, box.min_y);
  out += ',';
  AppendNumber(out, box.max_x);
  out += ',';
  AppendNumber(out, box.max_y);
  out += ']';
}

/// The box of the rings, except small ones (kMinorShare). If the frame has no rings, the box of its
/// particles.
Box MainBox(const FrameRecord& frame) {
  const Rings& rings = frame.result.rings;
  double largest = 0;
  for (const RingMeasures& measures : rings.measures) {
    largest = std::max(largest, std::abs(measures.area));
  }
  Box box;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    if (std::abs(rings.measures[ring].area) >= kMinorShare * largest) {
      box.Include(rings.RingPoints(ring));
    }
  }
  if (box.Empty()) box.Include(frame.particles);
  return box;
}

void AppendMeasures(std::string& out, const Rings& rings) {
  out += '[';
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const RingMeasures& measures = rings.measures[ring];
    out += ring == 0 ? "[" : ",[";
    AppendShown(out, measures.area);
    out += ',';
    AppendShown(out, measures.perimeter);
    // Identities are strings because numbers of JavaScript are exact up to 2^53 only.
    AppendAll(out, ",", measures.particle_count, ",\"", measures.identity, "\",[");
    bool first = true;
    for (const std::uint64_t parent : rings.ParentsOf(ring)) {
      AppendAll(out, first ? "\"" : ",\"", parent, "\"");
      first = false;
    }
    out += "]]";
  }
  out += ']';
}

void AppendSections(std::string& out, const FrameRecord& frame) {
  out += R"(,"sections":[)";
  for (std::size_t k = 0; k < frame.result.sections.size(); ++k) {
    const FrameRecord section = SectionOf(frame, k);
    const FrameStatistics& statistics = section.result.statistics;
    AppendAll(out, k == 0 ? "" : ",", R"({"particles":)", statistics.particles,
              R"(,"rings_digest":")", DigestText(section.rings_digest), R"(","area":)");
    AppendShown(out, statistics.area);
    out += R"(,"perimeter":)";
    AppendShown(out, statistics.perimeter);
    out += R"(,"measures":)";
    AppendMeasures(out, section.result.rings);
    out += '}';
  }
  out += ']';
}

void AppendDoubts(std::string& out, const Doubts& doubts) {
  out += R"(,"doubts":[)";
  bool first = true;
  for (const Doubt doubt : kAllDoubts) {
    if (!doubts.Has(doubt)) continue;
    AppendAll(out, first ? "\"" : ",\"", Explanation(doubt), "\"");
    first = false;
  }
  out += ']';
}

void AppendNamed(std::string& out, std::span<const std::pair<std::string_view, double>> numbers) {
  for (const auto& [name, value] : numbers) {
    AppendAll(out, ",\"", name, "\":");
    AppendShown(out, value);
  }
}

void AppendStages(std::string& out, const FrameRecord& frame) {
  out += R"(,"stages":{)";
  for (std::size_t k = 0; k < kStageCount; ++k) {
    AppendAll(out, k > 0 ? ",\"" : "\"", kStageNames[k], "\":");
    AppendShown(out, frame.stages_ms[k]);
  }
  out += '}';
}

std::string FrameNumbers(const FrameRecord& frame, const ReportOptions& options) {
  const Result& result = frame.result;
  const FrameStatistics& statistics = result.statistics;
  std::string out = Concat(R"({"frame":)", frame.index, R"(,"particles":)", statistics.particles,
                           R"(,"triangles_grid":)", statistics.triangles_grid, R"(,"triangles":)",
                           statistics.triangles);
  AppendAll(out, R"(,"self_intersections":)", statistics.self_intersections,
            R"(,"folded_triangles":)", statistics.folded_triangles, R"(,"dropped_holes":)",
            statistics.dropped_holes, R"(,"dropped_components":)", statistics.dropped_components,
            R"(,"dropped_spray":)", statistics.dropped_spray);
  AppendDoubts(out, statistics.doubts);
  const std::pair<std::string_view, double> numbers[] = {
      {"time", frame.time},
      {"area", statistics.area},
      {"perimeter", statistics.perimeter},
      {"spacing", statistics.spacing},
      {"milliseconds", frame.total_ms},
  };
  AppendNamed(out, numbers);
  AppendStages(out, frame);
  const std::size_t particles = frame.particles.size() / 2;
  AppendAll(out, R"(,"particles_shown":)", std::min(particles, options.max_particles),
            R"(,"particles_given":)", particles, R"(,"mesh_shown":)",
            result.mesh.TriangleCount() <= options.max_triangles ? "true" : "false",
            R"(,"rings_digest":")", DigestText(frame.rings_digest), R"(","mesh_digest":")",
            DigestText(frame.mesh_digest), R"(","box":)");
  AppendBox(out, MainBox(frame));
  if (const AttributeValues* color = FindAttribute(result, options.color_by); color != nullptr) {
    out += R"(,"colors":[)";
    for (std::size_t channel = 0; channel < ChannelCount(*color); ++channel) {
      const ValueRange range = ReportRange(frame, *color, channel);
      out += channel == 0 ? "[" : ",[";
      AppendShown(out, range.low);
      out += ',';
      AppendShown(out, range.high);
      out += ']';
    }
    out += ']';
  }
  out += R"(,"measures":)";
  AppendMeasures(out, result.rings);
  AppendSections(out, frame);
  out += '}';
  return out;
}

/// `shown`: null if the frame has no picture (ReportOptions::max_surface_bytes).
std::string SurfaceNumbers(const FrameRecord& frame, const ReportSurface* shown) {
  const Surface& surface = *frame.surface;
  const SurfaceTotals totals = TotalsOf(surface);
  std::string out =
      Concat(R"({"frame":)", frame.index, R"(,"particles":)", frame.result.statistics.particles,
             R"(,"triangles":)", surface.TriangleCount(), R"(,"bodies":)", totals.bodies,
             R"(,"cavities":)", totals.cavities, R"(,"genus":)", totals.genus);
  AppendAll(out, R"(,"dropped_holes":)", surface.statistics.dropped_cavities,
            R"(,"dropped_components":)", surface.statistics.dropped_components,
            R"(,"dropped_spray":)", surface.statistics.dropped_spray);
  AppendDoubts(out, frame.result.statistics.doubts);
  const std::pair<std::string_view, double> numbers[] = {
      {"time", frame.time},
      {"area", totals.area},
      {"volume", totals.volume},
      {"spacing", frame.result.statistics.spacing},
      {"milliseconds", frame.total_ms},
  };
  AppendNamed(out, numbers);
  AppendStages(out, frame);
  AppendAll(out, R"(,"has_picture":)", shown != nullptr ? "true" : "false",
            R"(,"triangles_shown":)", shown != nullptr ? shown->triangles : 0,
            R"(,"particles_shown":)", shown != nullptr ? shown->particles : 0,
            R"(,"particles_given":)", frame.particles_in_space.size() / 3, R"(,"surface_digest":")",
            DigestText(frame.surface_digest), R"("})");
  return out;
}

std::string Scripts(std::string_view numbers, std::string_view geometry) {
  return Concat("<script type=\"application/json\" class=\"frame-numbers\">", numbers,
                "</script><script type=\"text/plain\" class=\"frame-geometry\">", geometry,
                "</script>\n");
}

std::string ParameterRows(const std::vector<std::pair<std::string, std::string>>& parameters) {
  std::string out;
  for (const auto& [name, value] : parameters) {
    AppendAll(out, "<tr><th scope=\"row\">", EscapeHtml(name), "</th><td>", EscapeHtml(value),
              "</td></tr>\n");
  }
  return out;
}

std::string SummaryRows(const Summary& summary) {
  std::string out;
  for (const SummaryRow& row : summary.Rows()) {
    if (row.mean.empty()) {
      AppendAll(out, "<tr class=\"heading\"><th scope=\"rowgroup\" colspan=\"4\">",
                EscapeHtml(row.label), "</th></tr>\n");
      continue;
    }
    const bool part = row.label.starts_with(' ');
    AppendAll(out, "<tr", part ? " class=\"part\"" : "", "><th scope=\"row\">",
              EscapeHtml(row.label), "</th><td>", EscapeHtml(row.mean), "</td><td>",
              EscapeHtml(row.p50), "</td><td>", EscapeHtml(row.p99), "</td></tr>\n");
  }
  return out;
}

std::string Text(const SlicePlane& slice) {
  const auto text = [](const std::array<double, 3>& v) {
    return Concat("(", ShortestNumber(v[0]), ", ", ShortestNumber(v[1]), ", ", ShortestNumber(v[2]),
                  ")");
  };
  return Concat("through ", text(slice.origin), ", normal ", text(slice.normal));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> DescribeParameters(
    const ReconstructionParameters& parameters) {
  const auto spacings = [](double value) { return Concat(ShortestNumber(value), " spacings"); };
  const bool is_surface = parameters.output == Output::kSurface;
  const bool has_grains = parameters.boundary == Boundary::kGrains;
  const auto yes_no = [](bool value) { return std::string(value ? "on" : "off"); };
  std::vector<std::pair<std::string, std::string>> lines = {
      {"placement", std::string(Name(parameters.placement))},
      is_surface ? std::pair<std::string, std::string>("output", Name(parameters.output))
                 : std::pair<std::string, std::string>("fill", Name(parameters.fill)),
      {"spacing", parameters.spacing ? ShortestNumber(*parameters.spacing)
                                     : Concat("estimated, ", Name(parameters.spacing_rule))},
      {"kernel radius", spacings(parameters.kernel_radius)},
      {"cell size",
       Concat(ShortestNumber(parameters.cell_size), has_grains ? " half spacings" : " spacings")},
      {"reference radius", parameters.reference_radius ? spacings(*parameters.reference_radius)
                                                       : std::string("calibrated")},
  };
  if (parameters.placement == Placement::kFarthestParticle) {
    lines.emplace_back("surface offset", spacings(parameters.surface_offset));
  }
  if (parameters.sizes == Sizes::kOwn) lines.emplace_back("sizes", Name(parameters.sizes));
  if (has_grains) lines.emplace_back("boundary", Name(parameters.boundary));
  if (parameters.slice) lines.emplace_back("slice", Text(*parameters.slice));
  if (parameters.isovalue) lines.emplace_back("isovalue", ShortestNumber(*parameters.isovalue));
  for (std::size_t k = 0; k < parameters.sections.size(); ++k) {
    const Section& section = parameters.sections[k];
    std::string text = section.slice ? Concat("slice ", Text(*section.slice)) : "";
    if (section.isovalue) {
      AppendAll(text, text.empty() ? "" : ", ", "isovalue ", ShortestNumber(*section.isovalue));
    }
    if (section.phase) AppendAll(text, "phase ", *section.phase);
    lines.emplace_back(Concat("section ", k + 1), std::move(text));
  }
  for (std::size_t k = 0; k < parameters.walls.size(); ++k) {
    lines.emplace_back(Concat("wall ", k + 1), NumberList(parameters.walls[k].points));
  }
  for (const std::int32_t phase : parameters.wall_phases) {
    lines.emplace_back("walls", Concat(parameters.phase_attribute, "=", phase));
  }
  if (parameters.attribute_tolerance != ReconstructionParameters().attribute_tolerance) {
    lines.emplace_back("attribute tolerance", ShortestNumber(parameters.attribute_tolerance));
  }
  if (is_surface) {
    lines.emplace_back("thinning distance", spacings(parameters.surface.thinning_distance));
    if (parameters.surface.simplify > 0) {
      lines.emplace_back("simplify", spacings(parameters.surface.simplify));
    }
    if (parameters.surface.min_component_volume > 0) {
      lines.emplace_back(
          "smallest volume",
          Concat(ShortestNumber(parameters.surface.min_component_volume), " cubed spacings"));
    }
  } else {
    lines.emplace_back("normal memory", yes_no(parameters.normal_memory));
  }
  if (parameters.clean) lines.emplace_back("clean", yes_no(*parameters.clean));
  if (parameters.min_component_area > 0) {
    lines.emplace_back("smallest area",
                       Concat(ShortestNumber(parameters.min_component_area), " squared spacings"));
  }
  if (parameters.min_component_particles > 0) {
    lines.emplace_back("fewest particles", Concat(parameters.min_component_particles));
  }
  return lines;
}

absl::StatusOr<ReportWriter> ReportWriter::Create(const std::filesystem::path& path,
                                                  ReportOptions options) {
  absl::StatusOr<AtomicFile> file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  ReportWriter writer(*std::move(file), std::move(options));
  const std::string_view head =
      page::kReportPageHtml.substr(0, page::kReportPageHtml.find(kFramesMark));
  const ReportOptions& shown = writer.options_;
  absl::Status status = writer.file_.Append(Expand(head, [&](std::string_view name) {
    return EscapeHtml(name == "title"      ? shown.title
                      : name == "subtitle" ? shown.subtitle
                                           : shown.color_by);
  }));
  if (!status.ok()) return status;
  return writer;
}

std::string ReportWriter::OutlineScripts(const FrameRecord& frame) const {
  const std::string geometry = EncodeReportGeometry(frame, {.max_particles = options_.max_particles,
                                                            .max_triangles = options_.max_triangles,
                                                            .color_by = options_.color_by});
  return Scripts(FrameNumbers(frame, options_), absl::Base64Escape(geometry));
}

std::string ReportWriter::SurfaceScripts(const FrameRecord& frame) {
  has_surfaces_ = true;
  if (surface_bytes_ < options_.max_surface_bytes) {
    const ReportSurface shown = EncodeReportSurface(
        frame,
        {.max_particles = options_.max_particles, .max_triangles = options_.max_surface_triangles});
    const std::string geometry = absl::Base64Escape(shown.bytes);
    surface_bytes_ += geometry.size();
    if (surface_bytes_ <= options_.max_surface_bytes) {
      return Scripts(SurfaceNumbers(frame, &shown), geometry);
    }
  }
  return Scripts(SurfaceNumbers(frame, nullptr), "");
}

absl::Status ReportWriter::Add(const FrameRecord& frame) {
  return file_.Append(frame.surface ? SurfaceScripts(frame) : OutlineScripts(frame));
}

absl::Status ReportWriter::Finish(const Summary& summary, double wall_seconds) {
  const std::string_view tail =
      page::kReportPageHtml.substr(page::kReportPageHtml.find(kFramesMark) + kFramesMark.size());
  absl::Status status = file_.Append(Expand(tail, [&](std::string_view name) {
    if (name == "space" && !has_surfaces_) return std::string();
    if (name == "space") {
      return Concat("<script type=\"text/plain\" id=\"space-part\">", page::kReportSpaceTxt,
                    "</script>\n");
    }
    if (name == "headline") return EscapeHtml(summary.Headline(wall_seconds));
    if (name == "summary") return SummaryRows(summary);
    return ParameterRows(options_.parameters);
  }));
  if (!status.ok()) return status;
  return file_.Commit();
}

}  // namespace partiemc::client
