// `--stats FILE`: one row of numbers per frame and section.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/atomic_file.h"
#include "client/output/frame_record.h"

namespace partiemc::client {

/// The columns in their order: frame, particles, polylines, vertices, triangles_grid, triangles,
/// area, milliseconds; one per stage, "bins_ms" to "attributes_ms" ("vertices" alone would stand
/// there twice); perimeter, self_intersections, folded_triangles, dropped_holes,
/// dropped_components, dropped_spray, rings_digest, mesh_digest, time, doubts (their names, a blank
/// between two of them), section (0: the frame's own outline; a row for each follows it). Digests
/// are 16 hexadecimal digits, times milliseconds of wall time, areas and lengths world units;
/// `vertices` are those of the polylines.
std::span<const std::string_view> StatisticsColumns();

/// Writes CSV with a header line, or JSON as an array of one object per row (a number that is
/// not finite is null there), as the rows come. The file appears with Finish.
class StatisticsWriter {
 public:
  /// CSV or JSON by the extension of `path`.
  /// Errors: INVALID_ARGUMENT for any other extension; those of AtomicFile.
  static absl::StatusOr<StatisticsWriter> Create(const std::filesystem::path& path);

  absl::Status Add(const FrameRecord& frame);
  absl::Status Finish();

 private:
  absl::Status AddRow(const FrameRecord& frame);

  StatisticsWriter(AtomicFile file, bool json) : file_(std::move(file)), json_(json) {}

  AtomicFile file_;
  bool json_;
  bool empty_ = true;
};

}  // namespace partiemc::client
