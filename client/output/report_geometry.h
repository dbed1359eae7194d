// The geometry of a frame as the report's script reads it (report/geometry.js).
#pragma once

#include <cstddef>
#include <string>

#include "client/output/frame_record.h"

namespace partiemc::client {

struct ReportGeometryOptions {
  std::size_t max_particles = 0;
  std::size_t max_triangles = 0;
  std::string color_by = {};  ///< An attribute; empty: none.
};

/// Bytes, before base64. Integers are LEB128 varints, signed ones zigzagged; a coordinate is a
/// multiple of `step` from the origin, written as the difference to the one before.
///
///   float64 origin_x, origin_y, step       little-endian
///   rings       count; per ring: points, outer ring + 1 (0: is one itself)
///   points      x, y differences of all points of the rings
///   normals     count (0 or that of the points); per point one byte, 256 to the full turn
///   mesh points count of those after the rings' points; x, y differences. A mesh that does not
///               share the rings' points has them all here, and `shared` is 0
///   triangles   shared (0 or 1), count; per triangle (a - previous a) << 1 | interior as zigzag of
///               the difference, then b - a, c - a
///   particles   count; x, y differences, in an order that keeps them small
///   isolines    count of rings; of each its points; x, y differences of all of them
///   colours     count (0, that of the mesh's points or that of the rings'); per point one byte,
///   its
///               share of the frame's range of the attribute, 255 to the whole
std::string EncodeReportGeometry(const FrameRecord& frame, const ReportGeometryOptions& options);

}  // namespace partiemc::client
