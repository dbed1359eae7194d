#include "cli/replay_outputs.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "cli/input_source.h"

namespace partiemc::client {

absl::StatusOr<ReplayOutputs> ReplayOutputs::Create(const ReplayFlags& flags,
                                                    const ReconstructionParameters& parameters) {
  ReplayOutputs outputs;
  if (!flags.output_dir.empty()) {
    auto formats = ParseFrameFormats(flags.format);
    if (!formats.ok()) return formats.status();
    outputs.frames_show_normals_ = std::ranges::count(*formats, FrameFormat::kCsv) > 0;
    auto frames =
        FrameWriter::Create({.directory = flags.output_dir, .formats = *std::move(formats)});
    if (!frames.ok()) return frames.status();
    outputs.frames_ = *std::move(frames);
  }
  if (!flags.stats.empty()) {
    auto statistics = StatisticsWriter::Create(flags.stats);
    if (!statistics.ok()) return statistics.status();
    outputs.statistics_.emplace(*std::move(statistics));
  }
  if (!flags.report.empty()) {
    auto report = ReportWriter::Create(
        flags.report,
        {.title = BaseName(flags.input),
         .subtitle = flags.local ? "reconstructed in process"
                                 : "reconstructed by the server at " + flags.server.address,
         .parameters = DescribeParameters(Resolve(parameters))});
    if (!report.ok()) return report.status();
    outputs.report_.emplace(*std::move(report));
  }
  return outputs;
}

bool ReplayOutputs::WantsNormals() const { return frames_show_normals_ || report_.has_value(); }

absl::Status ReplayOutputs::Write(const FrameRecord& frame) {
  summary_.Add(frame);
  absl::Status status;
  if (frames_) status = frames_->Write(frame);
  if (status.ok() && statistics_) status = statistics_->Add(frame);
  if (status.ok() && report_) status = report_->Add(frame);
  return status;
}

absl::Status ReplayOutputs::Finish(double wall_seconds) {
  absl::Status status;
  if (statistics_) status = statistics_->Finish();
  if (status.ok() && report_) status = report_->Finish(summary_, wall_seconds);
  return status;
}

}  // namespace partiemc::client
