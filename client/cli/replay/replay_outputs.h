// The outputs of a replay: files, statistics, report and summary.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/frame_outputs.h"
#include "client/cli/replay/replay.h"
#include "client/input/sequence.h"
#include "client/output/frame_record.h"
#include "client/output/report.h"
#include "client/output/summary.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

class ReplayOutputs {
 public:
  /// Opens every output, so that an unwritable path is reported before the work begins.
  /// Errors: as FrameOutputs::Create; INVALID_ARGUMENT if an output would overwrite `input`.
  static absl::StatusOr<ReplayOutputs> Create(const ReplayFlags& flags,
                                              const ReconstructionParameters& parameters,
                                              const Sequence& input);

  /// Whether an output shows the normals of ring vertices.
  bool WantsNormals() const;

  absl::Status Write(const FrameRecord& frame);
  void AddRefused() { frames_.AddRefused(); }
  /// Makes the report and the summary state that the replay ended early, with the reason.
  void EndEarly(std::string why) { frames_.EndEarly(std::move(why)); }

  /// Completes the statistics and the report. If one of them fails, the other is still written.
  /// Until then neither file is created or replaced.
  absl::Status Finish(double wall_seconds);

  const Summary& summary() const { return frames_.summary(); }

 private:
  explicit ReplayOutputs(FrameOutputs frames) : frames_(std::move(frames)) {}

  FrameOutputs frames_;
  std::optional<ReportWriter> report_;
  bool is_surface_ = false;  ///< The report is of surfaces.
};

}  // namespace partiemc::client
