// The outputs of a verb that receives results frame by frame: files, statistics and summary.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/frame_record.h"
#include "client/output/frame_writer.h"
#include "client/output/statistics_writer.h"
#include "client/output/summary.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace partiemc::client {

CLI::Option* AddCompressGlbFlag(CLI::App& app, bool& compress_glb);

class FrameOutputs {
 public:
  /// Values of the flags with the same names. Empty: this output is not written.
  struct Places {
    std::string output_dir;
    std::string format;  ///< Empty: geojson, or ply for surfaces.
    std::string stats, color_by;
    bool compress_glb = false;
    bool surface = false;                  ///< The frames are surfaces in space.
    bool walls = false;                    ///< The stream has walls.
    bool sections = false;                 ///< The stream has sections.
    std::vector<std::string> gauges = {};  ///< "NAME=KIND:NUMBERS" (partiemc/gauges.h).
  };

  /// Errors: INVALID_ARGUMENT for a wrong format, extension or gauge, for a format, gauge or
  /// colours that surfaces do not have, and for `compress_glb` without GLB files.
  static absl::Status Check(const Places& places);

  /// Creates the output directory and opens the file of statistics. If an existing directory is not
  /// writable, the first Write fails. Errors: as Check and AtomicFile.
  static absl::StatusOr<FrameOutputs> Create(const Places& places);

  /// The files of statistics, and the files in the output directory that frames can replace.
  /// Requires: Check(places) is OK.
  static std::vector<std::string> Targets(const Places& places);

  /// Whether a file shows the normals of ring vertices.
  bool ShowNormals() const { return show_normals_; }

  absl::Status Write(const FrameRecord& frame);
  void AddRefused() { summary_.AddRefused(); }
  void EndEarly(std::string why) { summary_.EndEarly(std::move(why)); }

  /// Completes the statistics, and writes the collection files that list the frames. Until then
  /// none of these files is created or replaced.
  absl::Status Finish();

  const Summary& summary() const { return summary_; }

 private:
  std::optional<FrameWriter> frames_;
  bool show_normals_ = false;
  std::optional<StatisticsWriter> statistics_;
  std::optional<StatisticsWriter> section_statistics_;  // Of the sections of surfaces.
  Summary summary_;
};

/// Adds --stats and --gauge. The help of --gauge lists the kinds of gauges.
void AddStatisticsFlags(CLI::App& app, FrameOutputs::Places& places, const std::string& group);

}  // namespace partiemc::client
