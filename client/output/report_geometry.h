// Encodes the geometry of a frame for a report. client/viewer/src/report/geometry.ts decodes it.
#pragma once

#include <cstddef>
#include <string>

#include "client/output/color_map.h"
#include "client/output/frame_record.h"

namespace partiemc::client {

struct ReportGeometryOptions {
  std::size_t max_particles = 0;
  std::size_t max_triangles = 0;
  std::string color_by = {};  ///< Attribute, or empty.
};

/// Bytes, before base64. Integers are LEB128 varints, with zigzag encoding if signed. A coordinate
/// is a multiple of `step` from the origin. Each point is written as its difference from the point
/// before it in the bytes, also of another part; the first as its difference from (0, 0).
///
///   float64 origin_x, origin_y, step       little-endian
///   rings       count; per ring: number of points, index of its outer ring + 1 (0: an outer ring)
///   points      x, y differences of all points of the rings
///   normals     count (0 or the number of points); per point one byte, 256 per full turn
///   mesh points count, x, y differences: if the mesh shares the points of the rings, only its
///               further points; otherwise all points of the mesh
///   triangles   shared (1 if the mesh shares the points of the rings), count; per triangle
///               (a - previous a) * 2 + interior, b - a, c - a
///   particles   count; x, y differences, in an order that keeps them small
///   sizes       1 if the particles are discs, else 0; count (0 or the number of particles); per
///               particle its own size in steps
///   sections    count; per section: count of rings, per ring as above; x, y differences of
///               all points
///   colours     count of channels (color_map.h, 0 without an attribute); per channel two lists:
///               first for the points of the mesh, or of the rings without a mesh; then for the
///               particles, empty if their values are unknown; per list: count, per value one
///               byte, its position in the channel's range for this frame, from 0 to 255
std::string EncodeReportGeometry(const FrameRecord& frame, const ReportGeometryOptions& options);

/// Returns the range of a channel of `attribute` over the vertices and the particles.
ValueRange ReportRange(const FrameRecord& frame, const AttributeValues& attribute,
                       std::size_t channel);

}  // namespace partiemc::client
