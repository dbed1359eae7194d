// Writes `--stats FILE`: for each frame, one row of numbers for its own outline, and one for each
// of its sections (ReconstructionParameters::sections); or one row for its surface in space.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/atomic_file.h"
#include "client/output/frame_record.h"
#include "partiemc/gauges.h"

namespace partiemc::client {

/// The kind of frames in a file.
enum class StatisticsOf : std::uint8_t {
  kOutlines,
  kOutlinesAtWalls,  ///< Of a stream with ReconstructionParameters::walls or wall_phases.
  kSurfaces
};

/// The columns of outlines in order: frame, particles, polylines, vertices, triangles_grid,
/// triangles, area, milliseconds; one column of milliseconds per stage, "bins_ms" to
/// "attributes_ms"; perimeter, self_intersections, folded_triangles, dropped_holes,
/// dropped_components, dropped_spray, rings_digest, mesh_digest, time, doubts (names separated by
/// blanks), section.
///
/// Section 0 is the frame's own outline; a row for each section follows. The gauges
/// (partiemc/gauges.h) have the last columns: NAME for a gauge with one value, otherwise
/// NAME_VALUE. A gauge is "nan" if the outline has no such point. Digests have 16 hexadecimal
/// digits. Milliseconds are wall time. Areas and lengths are in world units. `polylines` counts
/// rings, `vertices` their vertices.
///
/// Outlines at walls have these columns between `section` and the gauges: wetted_length, the length
/// of the outline that lies on walls; contacts, the number of points where the outline meets a
/// wall; and contact_angle, the mean angle of the fluid at these points, in degrees ("nan" without
/// contacts).
///
/// The columns of surfaces in order: frame, particles, bodies, cavities, points, triangles, genus,
/// area, volume, milliseconds, dropped_cavities, dropped_components, dropped_spray, surface_digest,
/// time, doubts. Sections of a surface have no rows; they fit a file of outlines (SectionOf).
///
/// `genus` counts the handles of bodies and cavities. `volume` is the volume of bodies minus their
/// cavities. `area` is the sum over bodies and cavities.
std::span<const std::string_view> StatisticsColumns(StatisticsOf what = StatisticsOf::kOutlines);

/// Parses gauges. Checks that their columns differ from each other and from the columns of `what`.
/// Errors: as ParseGauge; INVALID_ARGUMENT for a column that exists already.
absl::StatusOr<std::vector<Gauge>> ParseGauges(const std::vector<std::string>& texts,
                                               StatisticsOf what = StatisticsOf::kOutlines);

/// Writes CSV with a header line, or a JSON array with one object per row, in which non-finite
/// numbers are null. The file appears with Finish.
class StatisticsWriter {
 public:
  /// INVALID_ARGUMENT if `path` ends neither in .csv nor in .json.
  static absl::Status CheckExtension(const std::filesystem::path& path);

  /// Selects CSV or JSON by the extension of `path`.
  /// Errors: as CheckExtension; INVALID_ARGUMENT for gauges of surfaces, since gauges measure
  /// outlines; as for AtomicFile.
  static absl::StatusOr<StatisticsWriter> Create(const std::filesystem::path& path,
                                                 std::vector<Gauge> gauges = {},
                                                 StatisticsOf what = StatisticsOf::kOutlines);

  /// Errors: INVALID_ARGUMENT for a surface among outlines, or an outline among surfaces; as for
  /// AtomicFile.
  absl::Status Add(const FrameRecord& frame);
  absl::Status Finish();

 private:
  absl::Status AddRow(const FrameRecord& frame);

  StatisticsWriter(AtomicFile file, bool json, std::vector<Gauge> gauges, StatisticsOf what);

  AtomicFile file_;
  bool json_;
  StatisticsOf what_;
  std::vector<Gauge> gauges_;
  std::vector<std::string> columns_;
  bool empty_ = true;
};

}  // namespace partiemc::client
