#include "client/cli/frame_outputs.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "CLI/CLI.hpp"
#include "client/output/text.h"
#include "partiemc/gauges.h"

namespace partiemc::client {

CLI::Option* AddCompressGlbFlag(CLI::App& app, bool& compress_glb) {
  return app.add_flag("--compress-glb", compress_glb,
                      "Compress the files of --format glb without loss, for readers that support "
                      "EXT_meshopt_compression");
}

CLI::Option* AddGaugeFlag(CLI::App& app, std::vector<std::string>& gauges) {
  std::string kinds;
  for (const GaugeTraits& traits : AllGauges()) {
    AppendAll(kinds, kinds.empty() ? "" : ", ", traits.name);
    char separator = ':';
    for (const std::string_view number : traits.numbers) {
      AppendAll(kinds, std::exchange(separator, ','), number);
    }
  }
  return app
      .add_option(
          "--gauge", gauges,
          "Measurement of the outline, in columns of --stats: NAME=KIND:NUMBERS, such as "
          "level=height:0.5. Repeat for more. packing uses the attribute radius or diameter "
          "of the particles, else their volumes. Kinds: " +
              kinds)
      ->type_name("NAME=KIND:...")
      ->allow_extra_args(false);
}

absl::StatusOr<FrameOutputs> FrameOutputs::Create(const Places& places) {
  FrameOutputs outputs;
  bool writes_glb = false;
  if (!places.output_dir.empty()) {
    auto formats = ParseFrameFormats(places.format);
    if (!formats.ok()) return formats.status();
    for (const FrameFormat format : *formats) {
      absl::Status status = places.surface ? CheckHoldsSurfaces(format) : absl::OkStatus();
      if (!status.ok()) return status;
    }
    writes_glb = std::ranges::count(*formats, FrameFormat::kGlb) > 0;
    outputs.show_normals_ = std::ranges::count(*formats, FrameFormat::kCsv) > 0;
    auto frames = FrameWriter::Create({.directory = places.output_dir,
                                       .formats = *std::move(formats),
                                       .color_by = places.color_by,
                                       .compress_glb = places.compress_glb});
    if (!frames.ok()) return frames.status();
    outputs.frames_ = *std::move(frames);
  }
  if (places.compress_glb && !writes_glb) {
    return absl::InvalidArgumentError("--compress-glb: requires --output-dir and --format glb");
  }
  if (!places.stats.empty()) {
    auto gauges = ParseGauges(places.gauges);
    if (!gauges.ok()) return gauges.status();
    auto statistics = StatisticsWriter::Create(
        places.stats, *std::move(gauges),
        places.surface ? StatisticsOf::kSurfaces : StatisticsOf::kOutlines);
    if (!statistics.ok()) return statistics.status();
    outputs.statistics_.emplace(*std::move(statistics));
  }
  return outputs;
}

absl::Status FrameOutputs::Write(const FrameRecord& frame) {
  summary_.Add(frame);
  absl::Status status;
  if (frames_) status = frames_->Write(frame);
  if (status.ok() && statistics_) status = statistics_->Add(frame);
  return status;
}

absl::Status FrameOutputs::Finish() {
  const absl::Status listed = frames_ ? frames_->Finish() : absl::OkStatus();
  const absl::Status counted = statistics_ ? statistics_->Finish() : absl::OkStatus();
  return listed.ok() ? counted : listed;
}

}  // namespace partiemc::client
