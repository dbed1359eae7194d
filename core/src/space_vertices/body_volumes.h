// Measures the volumes of bodies, and moves vertices to match the volumes of the particles.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/mesh.h"
#include "space_certificate/certificate.h"
#include "space_vertices/clipped_measures.h"

namespace partiemc::space {

/// Measures of a body, in the units of the measured positions.
struct BodyMeasure {
  double area = 0;    ///< Area of all its shells. With own sizes, each part times the local size.
  double volume = 0;  ///< Without its cavities.
};

struct BodyVolumes {
  std::vector<std::uint32_t> body_of;  ///< By vertex.
  std::vector<BodyMeasure> measures;   ///< By body.
  std::vector<double> areas;           ///< By loop: area of the triangles around its vertex.
  /// By vertex: the local size, in spacings, a factor of offsets. Empty for equal sizes.
  std::vector<float> sizes;

  double SizeOf(std::size_t vertex) const { return sizes.empty() ? 1 : double{sizes[vertex]}; }

  /// The space before the walls, and its part in the periodic box; absent without walls and without
  /// copies of particles. World units. `measures` count only the part of a body in `before_walls`,
  /// and of a body that is cut at the box only the part in `in_box`.
  std::optional<ClipBox> before_walls, in_box;

  struct Part {
    double area = 0, volume = 0;
  };
  std::vector<Part> parts;      ///< Scratch: by loop.
  std::vector<double> offsets;  ///< Scratch: by body.

  /// The smallest relative error of the volume of a body since BeginSearch.
  struct Best {
    double error = std::numeric_limits<double>::infinity();
    /// SearchVolumes no longer moves the body. Either it has put the body back to its best
    /// positions, or the body is settled (BeginSearch).
    bool is_final = false;
  };
  std::vector<Best> best;            ///< By body.
  std::vector<BodyStep> steps;       ///< By body: the result of the last SearchVolumes.
  std::vector<Vec3> best_positions;  ///< By vertex: the positions with the smallest error.
};

/// Finds the body of each vertex.
void FindBodyOfVertices(const BrickDirectory& bricks, const SpaceField& field,
                        const SpaceCrossings& crossings, const Bodies& bodies,
                        BodyVolumes& volumes);

/// Sets `measures` and `areas`, with all quads cut along their faces (QuadMode). Positions are in
/// cells. Requires: FindBodyOfVertices. Parallel over cells, then linear in loops.
void MeasureBodies(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                   const Bodies& bodies, const std::vector<Vec3>& positions, BodyVolumes& volumes);

/// Sets BodyVolumes::measures from the triangles of the bodies. `positions`: by vertex, in world
/// units. The areas and volumes of the measures are then in world units, too. Requires:
/// FindBodyOfVertices. Cost: linear in the triangles.
void MeasureTriangles(const BrickDirectory& bricks, double cell_size, const Bodies& bodies,
                      std::span<const Vec3> positions, std::span<const VertexTriangle> triangles,
                      BodyVolumes& volumes);

struct VolumeStep {
  double unit = 1;       ///< Unit of positions, in world units. SearchVolumes requires 1.
  double limit = 0;      ///< Longest offset of a body, in these units.
  double tolerance = 0;  ///< Relative error of the volume up to which a body does not move.
};

/// Moves the vertices of each body along their normals by one offset, times their local sizes. The
/// offset is (volume of its particles - its volume) / area, at most `step.limit` in both
/// directions. Bodies stay if they have no particles, or if the relative error of their volume is
/// at most `step.tolerance`. Requires: MeasureBodies of `positions`, or MeasureTriangles for `unit`
/// 1.
void MatchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                  BodyVolumes& volumes, std::vector<Vec3>& positions);

/// Starts a search: clears `best`. `is_settled`: by body, whether it stays; empty if none does.
void BeginSearch(const Bodies& bodies, const std::vector<Vec3>& positions,
                 std::span<const std::uint8_t> is_settled, BodyVolumes& volumes);

/// MatchVolumes as a step of a search. A body whose error has grown returns to its best positions
/// and stays there. Errors can grow because the certificate sets vertices back, in sheets of one
/// layer after most steps. With `step.limit` 0, bodies only return. Returns whether a body moved.
/// Requires: BeginSearch before the first step, MeasureTriangles before each.
bool SearchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                   BodyVolumes& volumes, std::vector<Vec3>& positions);

}  // namespace partiemc::space
