// What a verb that gets results frame by frame leaves behind, whichever way they come: files of
// frames, statistics, and the numbers of its table.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/frame_record.h"
#include "client/output/frame_writer.h"
#include "client/output/statistics_writer.h"
#include "client/output/summary.h"

namespace partiemc::client {

class FrameOutputs {
 public:
  /// As the flags of the same names; empty: none.
  struct Places {
    std::string output_dir, format, stats, color_by;
  };

  /// Opens each, so that a place that cannot be written is known before the work.
  /// Errors: INVALID_ARGUMENT for a wrong format or extension, those of AtomicFile.
  static absl::StatusOr<FrameOutputs> Create(const Places& places);

  /// Whether the files show the normals of the vertices.
  bool ShowNormals() const { return show_normals_; }

  absl::Status Write(const FrameRecord& frame);
  void AddRefused() { summary_.AddRefused(); }
  void EndEarly(std::string why) { summary_.EndEarly(std::move(why)); }

  /// Completes the statistics, which do not exist before.
  absl::Status Finish();

  const Summary& summary() const { return summary_; }

 private:
  std::optional<FrameWriter> frames_;
  bool show_normals_ = false;
  std::optional<StatisticsWriter> statistics_;
  Summary summary_;
};

}  // namespace partiemc::client
