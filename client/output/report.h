// Writes `--report FILE.html`: the frames of a replay as one page.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/atomic_file.h"
#include "client/output/frame_record.h"
#include "client/output/summary.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

struct ReportOptions {
  std::string title = {};     ///< Any text, for example the input's name. Escaped.
  std::string subtitle = {};  ///< Any text. Escaped.
  /// Names and values of the replay's parameters, in the order shown.
  std::vector<std::pair<std::string, std::string>> parameters = {};
  /// A frame with more particles shows an even selection, with a note.
  std::size_t max_particles = 20'000;
  /// An outline with more triangles shows no mesh, with a note.
  std::size_t max_triangles = 300'000;
  /// A surface with more triangles is simplified, with a note.
  std::size_t max_surface_triangles = 100'000;
  /// Limit on the total size of the pictures of surfaces in the file. The first frame that exceeds
  /// it and all later frames have numbers but no picture, with a note.
  std::size_t max_surface_bytes = 200'000'000;
  std::string color_by = {};  ///< As in FrameWriterOptions.
};

/// The parameters of a reconstruction, for ReportOptions::parameters.
std::vector<std::pair<std::string, std::string>> DescribeParameters(
    const ReconstructionParameters& parameters);

/// Writes one HTML file that requires no network and no other file. Add writes its frame to disk,
/// so memory does not grow. The file appears with Finish. Its size is 190 kB, plus about four bytes
/// per particle and vertex, eight per triangle and 200 per ring. Geometry is rounded to 1/128 of
/// the spacing.
/// With surfaces it has 233 kB more, for drawing in space, plus about seven bytes per triangle and
/// per particle, and four per value of an attribute (report_surface.h).
class ReportWriter {
 public:
  /// Errors: as for AtomicFile.
  static absl::StatusOr<ReportWriter> Create(const std::filesystem::path& path,
                                             ReportOptions options);

  /// Errors: as for AtomicFile.
  absl::Status Add(const FrameRecord& frame);

  /// Adds the table of `summary` and completes the file.
  absl::Status Finish(const Summary& summary, double wall_seconds);

 private:
  ReportWriter(AtomicFile file, ReportOptions options)
      : file_(std::move(file)), options_(std::move(options)) {}

  std::string OutlineScripts(const FrameRecord& frame) const;
  std::string SurfaceScripts(const FrameRecord& frame);

  AtomicFile file_;
  ReportOptions options_;
  bool has_surfaces_ = false;
  std::size_t surface_bytes_ = 0;  ///< Total size of the pictures of surfaces.
};

}  // namespace partiemc::client
