#include "client/cli/frame_outputs.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/output/text.h"
#include "partiemc/gauges.h"

namespace partiemc::client {

CLI::Option* AddCompressGlbFlag(CLI::App& app, bool& compress_glb) {
  return app.add_flag("--compress-glb", compress_glb,
                      "Compress the files of --format glb without loss, for readers that support "
                      "EXT_meshopt_compression");
}

void AddStatisticsFlags(CLI::App& app, FrameOutputs::Places& places, const std::string& group) {
  std::string kinds;
  for (const GaugeTraits& traits : AllGauges()) {
    AppendAll(kinds, kinds.empty() ? "" : ", ", traits.name);
    char separator = ':';
    for (const std::string_view number : traits.numbers) {
      AppendAll(kinds, std::exchange(separator, ','), number);
    }
  }
  CLI::Option* const stats =
      app.add_option("--stats", places.stats,
                     "Statistics of every frame, as CSV or JSON by extension. Sections of surfaces "
                     "have a second file: FILE_sections.csv for FILE.csv")
          ->type_name("FILE")
          ->group(group);
  app.add_option("--gauge", places.gauges,
                 "Measurement of the outline, in columns of --stats: NAME=KIND:NUMBERS, such as "
                 "level=height:0.5. Repeat for more. packing uses the attribute radius or diameter "
                 "of the particles, else their volumes. Kinds: " +
                     kinds)
      ->type_name("NAME=KIND:...")
      ->allow_extra_args(false)
      ->needs(stats)
      ->group(group);
}

namespace {

std::string_view FormatOf(const FrameOutputs::Places& places) {
  if (!places.format.empty()) return places.format;
  return places.surface ? "ply" : "geojson";
}

StatisticsOf StatisticsFor(const FrameOutputs::Places& places) {
  if (places.surface) return StatisticsOf::kSurfaces;
  return places.walls ? StatisticsOf::kOutlinesAtWalls : StatisticsOf::kOutlines;
}

// The file of statistics of the sections of surfaces: "FILE_sections.csv" for "FILE.csv". Their
// columns differ from those of surfaces. Sections of outlines have rows in the file of the
// outlines.
std::optional<std::string> SectionStatistics(const FrameOutputs::Places& places) {
  if (places.stats.empty() || !places.surface || !places.sections) return std::nullopt;
  std::filesystem::path path = places.stats;
  const std::string extension = path.extension().string();
  return path.replace_extension().string() + "_sections" + extension;
}

absl::Status CheckSurfaces(const FrameOutputs::Places& places,
                           std::span<const FrameFormat> formats) {
  if (!places.surface) return absl::OkStatus();
  if (!places.gauges.empty()) {
    return absl::InvalidArgumentError("--gauge: measures outlines, but the frames are surfaces");
  }
  for (const FrameFormat format : formats) {
    if (absl::Status status = CheckHoldsSurfaces(format); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status FrameOutputs::Check(const Places& places) {
  std::vector<FrameFormat> formats;
  if (!places.output_dir.empty()) {
    auto parsed = ParseFrameFormats(FormatOf(places));
    if (!parsed.ok()) return parsed.status();
    formats = *std::move(parsed);
  }
  if (places.compress_glb && std::ranges::count(formats, FrameFormat::kGlb) == 0) {
    return absl::InvalidArgumentError("--compress-glb: requires --output-dir and --format glb");
  }
  const StatisticsOf what = StatisticsFor(places);
  if (auto gauges = ParseGauges(places.gauges, what); !gauges.ok()) return gauges.status();
  if (!places.stats.empty()) {
    auto status = StatisticsWriter::CheckExtension(places.stats);
    if (!status.ok()) return status;
  }
  return CheckSurfaces(places, formats);
}

std::vector<std::string> FrameOutputs::Targets(const Places& places) {
  std::vector<std::string> targets;
  if (!places.stats.empty()) targets.push_back(places.stats);
  if (auto stats = SectionStatistics(places)) targets.push_back(*std::move(stats));
  if (places.output_dir.empty()) return targets;
  const std::vector<FrameFormat> formats = *ParseFrameFormats(FormatOf(places));
  std::error_code error;
  for (std::filesystem::directory_iterator it(places.output_dir, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (std::ranges::any_of(formats, [&](FrameFormat f) { return IsFrameFile(name, f); })) {
      targets.push_back(it->path().string());
    }
  }
  return targets;
}

absl::StatusOr<FrameOutputs> FrameOutputs::Create(const Places& places) {
  if (absl::Status status = Check(places); !status.ok()) return status;
  FrameOutputs outputs;
  if (!places.output_dir.empty()) {
    auto formats = *ParseFrameFormats(FormatOf(places));
    outputs.show_normals_ = std::ranges::count(formats, FrameFormat::kCsv) > 0;
    auto frames = FrameWriter::Create({.directory = places.output_dir,
                                       .formats = std::move(formats),
                                       .color_by = places.color_by,
                                       .compress_glb = places.compress_glb});
    if (!frames.ok()) return frames.status();
    outputs.frames_ = *std::move(frames);
  }
  if (!places.stats.empty()) {
    const StatisticsOf what = StatisticsFor(places);
    auto statistics =
        StatisticsWriter::Create(places.stats, *ParseGauges(places.gauges, what), what);
    if (!statistics.ok()) return statistics.status();
    outputs.statistics_.emplace(*std::move(statistics));
  }
  if (const auto stats = SectionStatistics(places)) {
    auto statistics = StatisticsWriter::Create(*stats);
    if (!statistics.ok()) return statistics.status();
    outputs.section_statistics_.emplace(*std::move(statistics));
  }
  return outputs;
}

absl::Status FrameOutputs::Write(const FrameRecord& frame) {
  summary_.Add(frame);
  absl::Status status;
  if (frames_) status = frames_->Write(frame);
  if (status.ok() && statistics_) status = statistics_->Add(frame);
  for (std::size_t k = 0; section_statistics_ && k < frame.result.sections.size(); ++k) {
    if (status.ok()) status = section_statistics_->Add(SectionOf(frame, k));
  }
  return status;
}

absl::Status FrameOutputs::Finish() {
  absl::Status status = frames_ ? frames_->Finish() : absl::OkStatus();
  if (statistics_) status.Update(statistics_->Finish());
  if (section_statistics_) status.Update(section_statistics_->Finish());
  return status;
}

}  // namespace partiemc::client
