// `--report FILE.html`: a replay as one page that can be looked at.
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
  std::string title = {};     ///< Any text: the input's name, say. Escaped here, as all text is.
  std::string subtitle = {};  ///< Any text, one line below the title.
  /// Name and value of what the replay was run with, in the order shown.
  std::vector<std::pair<std::string, std::string>> parameters = {};
  /// A frame with more shows an even choice of its particles, and the page says so.
  std::size_t max_particles = 20'000;
  /// A frame with more triangles shows no mesh, and the page says so.
  std::size_t max_triangles = 300'000;
  std::string color_by = {};  ///< As FrameWriterOptions has it.
};

/// The parameters of a reconstruction as lines for ReportOptions::parameters.
std::vector<std::pair<std::string, std::string>> DescribeParameters(
    const ReconstructionParameters& parameters);

/// Writes one HTML file that needs nothing else: no network, no other file. Frames go to the file
/// as they come; memory does not grow with them. The file appears with Finish.
/// Size: about four bytes per particle and vertex, eight per triangle and 200 per ring.
/// Geometry is rounded to 1/128 of the spacing: it is there to be looked at.
class ReportWriter {
 public:
  /// Errors: those of AtomicFile.
  static absl::StatusOr<ReportWriter> Create(const std::filesystem::path& path,
                                             ReportOptions options);

  absl::Status Add(const FrameRecord& frame);

  /// Completes the page with the table of `summary`.
  absl::Status Finish(const Summary& summary, double wall_seconds);

 private:
  ReportWriter(AtomicFile file, ReportOptions options)
      : file_(std::move(file)), options_(std::move(options)) {}

  AtomicFile file_;
  ReportOptions options_;
};

}  // namespace partiemc::client
