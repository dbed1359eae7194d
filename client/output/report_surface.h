// The picture of a surface in a report.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "client/output/frame_record.h"

namespace partiemc::client {

struct ReportSurfaceOptions {
  /// A frame with more particles shows an even selection.
  std::size_t max_particles = 20'000;
  /// A surface with more triangles is simplified (LevelOfDetail).
  std::size_t max_triangles = 100'000;
};

struct ReportSurface {
  std::string bytes;
  /// Shown triangles. 0 if the surface is empty, or left out because it cannot be simplified to
  /// `max_triangles` or because its coordinates do not fit.
  std::uint64_t triangles = 0;
  std::uint64_t particles = 0;  ///< Shown particles.
};

/// Encodes surface, sections and particles of a frame. Points are rounded to about 1/1024 of the
/// spacing, particles to 1/32. ReportBytes encodes counts and differences:
///
///   message     count of bytes; a partiemc.v1.ReconstructedFrame with a compact surface without
///               normals, the rings of the sections, and the statistics
///   particles   origin x, y, z; step (float64, little-endian); count; x, y, z differences, in an
///               order that keeps them small. The origin is not finite without particles.
///
/// Requires: frame.surface.
ReportSurface EncodeReportSurface(const FrameRecord& frame, const ReportSurfaceOptions& options);

}  // namespace partiemc::client
