// Volumes of bodies: measures them, and matches them to the volume of their particles.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"

namespace partiemc::space {

/// Size of a body with its cavities, in cells.
struct BodyMeasure {
  double area = 0, volume = 0;
  Vec3 centroid;
};

struct BodyVolumes {
  std::vector<std::uint32_t> body_of;  ///< By vertex.
  std::vector<BodyMeasure> measures;   ///< By body.
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

/// Moves the vertices of each body along their normals by one offset: (volume of its
/// particles
/// - its volume) / area, limited to +-`limit` cells.
/// Requires: MeasureBodies of `positions`.
void MatchVolumes(const Bodies& bodies, double cell_size, double limit, const BodyVolumes& volumes,
                  const std::vector<Vec3>& normals, std::vector<Vec3>& positions);

}  // namespace partiemc::space
