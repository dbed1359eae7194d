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
/// is a multiple of `step` from the origin, written as the difference from the previous coordinate.
///
///   float64 origin_x, origin_y, step       little-endian
///   rings       count; per ring: number of points, index of its outer ring + 1 (0: an outer ring)
///   points      x, y differences of all points of the rings
///   normals     count (0 or the number of points); per point one byte, 256 per full turn
///   mesh points count, x, y differences: the points after those of the rings, or all points of a
///   mesh
///               that does not share the points of the rings
///   triangles   shared (1 if the mesh shares the points of the rings), count; per triangle
///               (a - previous a) * 2 + interior, b - a, c - a
///   particles   count; x, y differences, in an order that keeps them small
///   sections    count; per section: count of rings, per ring as above; x, y differences of all
///   points colours     count of channels (color_map.h, 0 without an attribute); per channel twice:
///   count,
///               and per point one byte, the position in the frame's range of the channel from 0 to
///               255. First the points of the mesh, or of the rings alone; then the particles, or
///               none if their values are unknown
std::string EncodeReportGeometry(const FrameRecord& frame, const ReportGeometryOptions& options);

/// Range of a channel of `attribute` at the vertices and at the particles.
ValueRange ReportRange(const FrameRecord& frame, const AttributeValues& attribute,
                       std::size_t channel);

}  // namespace partiemc::client
