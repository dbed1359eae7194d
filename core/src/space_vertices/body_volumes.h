// Volumes of bodies: measures them, and matches them to the volume of their particles.
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

/// Measures of a body, which its outer shell and its cavities bound.
struct BodyMeasure {
  double area = 0;  ///< With own sizes, each part times the local size.
  double volume = 0;
};

struct BodyVolumes {
  std::vector<std::uint32_t> body_of;  ///< By vertex.
  std::vector<BodyMeasure> measures;   ///< By body.
  std::vector<double> areas;           ///< By loop: area of the triangles around its vertex.
  /// By vertex: the local size, in spacings, by which offsets are multiplied; empty for equal
  /// sizes.
  std::vector<float> sizes;

  double SizeOf(std::size_t vertex) const { return sizes.empty() ? 1 : double{sizes[vertex]}; }

  /// With walls, the space before them; with copies of particles, the periodic box. In world units.
  /// Areas and volumes are those of the parts in it.
  std::optional<ClipBox> clip;
  /// Only bodies that are cut are clipped, and all images of a body have the measures of their sum.
  /// They then move alike.
  bool clips_images = false;

  struct Part {
    double area = 0, volume = 0;
  };
  std::vector<Part> parts;      ///< Scratch: by loop.
  std::vector<double> offsets;  ///< Scratch: by body.

  /// The smallest error of a body so far.
  struct Best {
    double error = std::numeric_limits<double>::infinity();
    bool is_final = false;  ///< The body stays as it was then.
  };
  std::vector<Best> best;            ///< By body.
  std::vector<BodyStep> steps;       ///< By body: what SearchVolumes did.
  std::vector<Vec3> best_positions;  ///< By vertex: with the smallest error of its body.
};

/// Finds the body of each vertex.
void FindBodyOfVertices(const BrickDirectory& bricks, const SpaceField& field,
                        const SpaceCrossings& crossings, const Bodies& bodies,
                        BodyVolumes& volumes);

/// Measures the bodies, with all quads cut along their faces. Positions are in cells.
/// Requires: FindBodyOfVertices. Parallel over cells, then linear in loops.
void MeasureBodies(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                   const Bodies& bodies, const std::vector<Vec3>& positions, BodyVolumes& volumes);

/// Measures the bodies that the triangles bound. Positions, area and volume are in world units.
/// Requires: FindBodyOfVertices. Linear in triangles.
void MeasureTriangles(const BrickDirectory& bricks, double cell_size, const Bodies& bodies,
                      std::span<const Vec3> positions, std::span<const VertexTriangle> triangles,
                      BodyVolumes& volumes);

struct VolumeStep {
  double unit = 1;       ///< Length of the unit of positions, in world units.
  double limit = 0;      ///< Longest offset, in units.
  double tolerance = 0;  ///< Relative error up to which a body is not moved.
};

/// Moves the vertices of each body along their normals by one offset, times their local sizes:
/// (volume of its particles - its volume) / area, limited. Returns whether a body has moved.
/// Requires: MeasureBodies of `positions`, or MeasureTriangles for `unit` 1.
bool MatchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                  BodyVolumes& volumes, std::vector<Vec3>& positions);

/// Forgets the best positions of an earlier frame.
void BeginSearch(const Bodies& bodies, const std::vector<Vec3>& positions, BodyVolumes& volumes);

/// MatchVolumes as a step of a search: a body whose error has grown returns to its positions with
/// the smallest error, for good. Steps can fail, because the certificate sets vertices back: in
/// sheets of one layer most of them. With `step.limit` 0, bodies only return. Returns whether a
/// body has moved.
/// Requires: BeginSearch before the first step; otherwise as MatchVolumes.
bool SearchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                   BodyVolumes& volumes, std::vector<Vec3>& positions);

}  // namespace partiemc::space
