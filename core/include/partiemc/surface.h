// Closed surfaces in space, and the check of their guarantees.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/attribute_values.h"
#include "partiemc/doubt.h"
#include "partiemc/surface_state.h"

namespace partiemc {

struct ShellMeasures {
  double area = 0;    ///< World units squared, without the triangles of Surface::cuts.
  double volume = 0;  ///< Enclosed, world units cubed; negative for a cavity.
  double centroid_x = 0, centroid_y = 0, centroid_z = 0;  ///< Centroid of the volume, world units.
  std::uint64_t particles = 0;  ///< Particles of the body; 0 for a cavity.
  /// The shell that continues this shell in the next frame has the same identity. Distinct within a
  /// frame, never reused in a stream (core/SURFACES.md, "Identities").
  std::uint64_t identity = 0;  ///< 0: not tracked.

  friend bool operator==(const ShellMeasures&, const ShellMeasures&) = default;
};

struct SurfaceStatistics {
  std::uint64_t dropped_cavities = 0;    ///< Cavities that cleaning filled.
  std::uint64_t dropped_components = 0;  ///< Bodies without a particle that cleaning removed.
  /// Bodies that were removed because they are smaller than `min_component_volume` or
  /// `min_component_particles`.
  std::uint64_t dropped_spray = 0;
  std::uint64_t bricks = 0;  ///< Bricks of 8 x 8 x 8 nodes that were allocated.
  Doubts doubts;             ///< Reasons to distrust the surface.

  friend bool operator==(const SurfaceStatistics&, const SurfaceStatistics&) = default;
};

/// Closed surfaces. A shell is one connected surface: the outside of a body, or a cavity in one.
/// Guarantees (core/SURFACES.md):
///   S1 every edge has exactly two triangles, which run along it in opposite directions;
///   S2 the triangles around each point form one cycle; each point has triangles of one shell;
///   S3 triangles intersect only in their common points and edges; none is degenerate;
///   S4 triangles are counter-clockwise seen from outside the body; shells alternate: the next
///      shell around an outer shell, if any, is a cavity, and the next shell around a cavity is the
///      outer shell that `outer_of` gives;
///   S5 offsets, normals and measures fit the triangles: normals have length 1; areas, volumes and
///      centroids are computed from the triangles. Each triangle of `cuts` has one coordinate that
///      is the same at its three corners.
struct Surface {
  std::vector<double> points;            ///< x0, y0, z0, x1, ... in world units, by shell.
  std::vector<std::uint32_t> triangles;  ///< Three point indices each, by shell.
  std::vector<float> normals;            ///< Per point: outward unit normal, interleaved.
  std::vector<std::uint32_t> point_offsets = {0};     ///< Shell k: [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> triangle_offsets = {0};  ///< The same for triangles.
  std::vector<std::uint32_t> outer_of;                ///< Per shell: its outer shell, or kNoShell.
  std::vector<ShellMeasures> measures;                ///< Per shell.
  /// Parents of shell k, [parent_offsets[k], parent_offsets[k + 1]): the identities, ascending, of
  /// the shells of the last frame that shell k continues. A new shell has no parent, a body after a
  /// merge has several. After a split, several bodies have the same parent.
  std::vector<std::uint64_t> parents;
  std::vector<std::uint32_t> parent_offsets = {0};  ///< {0} without identities.
  /// Indices of triangles, ascending, on walls (SurfaceParameters::wall_planes) or on faces of the
  /// periodic box, where a body was cut. They close the surface; areas do not count them. They have
  /// inner points if the frame has attributes and the surface is not simplified.
  std::vector<std::uint32_t> cuts;
  /// The attributes of the frame at the points, in the order of Frame::attributes: `components`
  /// values per point.
  std::vector<AttributeValues> attributes;
  SurfaceStatistics statistics;

  std::size_t ShellCount() const { return outer_of.size(); }
  std::size_t PointCount() const { return points.size() / 3; }
  std::size_t TriangleCount() const { return triangles.size() / 3; }
  std::span<const std::uint64_t> ParentsOf(std::size_t shell) const {
    if (shell + 1 >= parent_offsets.size()) return {};
    return std::span(parents).subspan(parent_offsets[shell],
                                      parent_offsets[shell + 1] - parent_offsets[shell]);
  }
  /// Empties everything, except that `attributes` keep their names and components.
  void Clear();
  friend bool operator==(const Surface&, const Surface&) = default;
};

/// Checks S1 to S5, independently of the construction: S1 to S4 with exact arithmetic, measures to
/// 1e-6 of the shell's size. Errors: INTERNAL with the guarantee, the triangle or shell, and the
/// values. Cost: n log n in the triangles if they are of similar size.
absl::Status Validate(const Surface& surface);

}  // namespace partiemc
