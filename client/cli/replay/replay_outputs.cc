#include "client/cli/replay/replay_outputs.h"

#include <string>
#include <utility>
#include <vector>

#include "client/cli/input_source.h"

namespace partiemc::client {

namespace {

FrameOutputs::Places PlacesOf(const ReplayFlags& flags,
                              const ReconstructionParameters& parameters) {
  FrameOutputs::Places places = flags.files;
  places.sections = !parameters.sections.empty();
  places.surface = flags.surface;
  places.walls = !flags.walls.empty();
  return places;
}

}  // namespace

absl::StatusOr<ReplayOutputs> ReplayOutputs::Create(const ReplayFlags& flags,
                                                    const ReconstructionParameters& parameters,
                                                    const Sequence& input) {
  const FrameOutputs::Places places = PlacesOf(flags, parameters);
  if (absl::Status status = FrameOutputs::Check(places); !status.ok()) return status;
  std::vector<std::string> targets = FrameOutputs::Targets(places);
  if (!flags.report.empty()) targets.push_back(flags.report);
  if (absl::Status status = CheckKeepsInput(flags.input, input, targets); !status.ok()) {
    return status;
  }
  auto frames = FrameOutputs::Create(places);
  if (!frames.ok()) return frames.status();
  ReplayOutputs outputs(*std::move(frames));
  if (!flags.report.empty()) {
    auto report = ReportWriter::Create(
        flags.report,
        {.title = BaseName(flags.input),
         .subtitle = flags.local ? "reconstructed in process"
                                 : "reconstructed by the server at " + flags.server.address,
         .parameters = DescribeParameters(Resolve(parameters)),
         .max_particles = flags.report_particles,
         .color_by = flags.files.color_by});
    if (!report.ok()) return report.status();
    outputs.report_.emplace(*std::move(report));
    outputs.is_surface_ = flags.surface;
  }
  return outputs;
}

bool ReplayOutputs::WantsNormals() const {
  // The report computes the normals of surfaces from the triangles.
  return frames_.ShowNormals() || (report_.has_value() && !is_surface_);
}

absl::Status ReplayOutputs::Write(const FrameRecord& frame) {
  absl::Status status = frames_.Write(frame);
  if (status.ok() && report_) status = report_->Add(frame);
  return status;
}

absl::Status ReplayOutputs::Finish(double wall_seconds) {
  absl::Status status = frames_.Finish();
  if (report_) status.Update(report_->Finish(summary(), wall_seconds));
  return status;
}

}  // namespace partiemc::client
