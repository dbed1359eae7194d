// Volumes of bodies: measures them, and matches them to the volume of their particles.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"

namespace partiemc::space {

/// Of a body with its cavities, in cells.
struct BodyMeasure {
  double area = 0, volume = 0;
  Vec3 centroid;
};

/// How the vertices of a body of spray leave their anchors.
struct SprayScale {
  Vec3 centroid;     ///< Of the body at its anchors.
  double scale = 0;  ///< 0: the body is no spray.
};

struct BodyVolumes {
  std::vector<std::uint32_t> body_of;  ///< By vertex.
  std::vector<BodyMeasure> measures;   ///< By body.
  std::vector<SprayScale> spray;       ///< By body.
  std::vector<double> areas;           ///< By loop: of the triangles around its vertex.

  struct Part {
    double volume = 0;
    Vec3 moment;
  };
  std::vector<Part> parts;  ///< Scratch: by loop.
};

/// Finds the body of each vertex.
void FindBodyOfVertices(const BrickDirectory& bricks, const SpaceField& field,
                        const SpaceCrossings& crossings, const Bodies& bodies,
                        BodyVolumes& volumes);

/// Measures the bodies, with all quads cut along their faces.
/// Requires: FindBodyOfVertices. Parallel over cells, then linear in loops.
void MeasureBodies(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                   const Bodies& bodies, const std::vector<Vec3>& positions, BodyVolumes& volumes);

/// Decides which bodies are spray: those with an area below `least_area`. Finds the scales that
/// give them the volume of their particles, between 1 / 4 and 4. Requires: MeasureBodies of the
/// anchors. Lengths in cells, `cell_size` in world units.
void FindSpray(const Bodies& bodies, double cell_size, double least_area, BodyVolumes& volumes);

/// Moves the vertices of each other body along their normals by one offset: (volume of its
/// particles
/// - its volume) / area, limited to +-`limit` cells.
/// Requires: FindSpray, MeasureBodies of `positions`.
void MatchVolumes(const Bodies& bodies, double cell_size, double limit, const BodyVolumes& volumes,
                  const std::vector<Vec3>& normals, std::vector<Vec3>& positions);

/// Places the vertices of spray: its anchors, scaled about its centroid. Requires: FindSpray.
void PlaceSpray(const BodyVolumes& volumes, const std::vector<Vec3>& anchors,
                std::vector<Vec3>& positions);

}  // namespace partiemc::space
