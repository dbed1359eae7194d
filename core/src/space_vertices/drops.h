// Replaces the surfaces of drops by ellipsoids, which keep their volume and follow their particles.
//
// The level set of a few particles encloses few nodes or none. The surface of such a drop depends
// on its place in the lattice. Its volume is wrong, and it trembles as it moves. An ellipsoid with
// the moments of its particles does not. A drop keeps its surface where others are near: the box of
// the ellipsoid and of the former surface must touch no other triangle (core/SURFACES.md, "Drops").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/lattice.h"
#include "space/mesh.h"
#include "space_certificate/moved_nodes.h"

namespace partiemc::space {

struct DropLimits {
  std::uint64_t most_particles = 0;  ///< Larger bodies keep their surfaces.
  /// A particle without a body stays without a surface if these exclude bodies of one particle.
  std::uint64_t least_particles = 0;
  double least_volume = 0;  ///< World units cubed.
};

struct DropsInput {
  const Frame& frame;
  const SpaceBins& bins;
  const Scale& scale;
  const Bodies& bodies;
  const MovedNodes& nodes;
  std::span<const std::uint32_t> body_of;  ///< By vertex of SpaceCrossings.
  bool takes_copies = false;  ///< Copies without a body become drops, too: the box wraps.
};

struct Drops {
  struct Box {
    Vec3 low, high;
  };
  struct Drop {
    std::uint32_t body = kNoIndex;      ///< kNoIndex: a particle without a body.
    std::uint32_t particle = kNoIndex;  ///< Of SpaceBins: a particle without a body.
    std::uint64_t particles = 0;
    double volume = 0;   ///< Cells cubed; as its moments.
    Vec3 origin, first;  ///< First moment relative to the origin.
    /// Second moments xx, xy, xz, yy, yz, zz. They include those of each particle as a ball.
    std::array<double, 6> second{};
    Box box;  ///< Holds the ellipsoid and the former surface. World units.
    bool is_taken = false;
    std::uint32_t first_point = 0;   ///< In `points`.
    std::uint32_t first_vertex = 0;  ///< The first vertex of the surface, if it is taken.
  };
  std::vector<Drop> drops;

  std::vector<std::uint32_t> drop_of;  ///< Scratch: by body, or kNoIndex.
  std::vector<Vec3> points, normals;   ///< Scratch: of the ellipsoids, world units.
  struct Reach {
    std::uint32_t brick, drop;
    friend auto operator<=>(const Reach&, const Reach&) = default;
  };
  BrickDirectory bricks;             ///< Scratch: which boxes reach.
  std::vector<Reach> reaches;        ///< Scratch.
  std::vector<std::uint32_t> first;  ///< Scratch: by brick, into `reaches`.
};

/// Removes the triangles of drops, and adds ellipsoids behind the vertices of SpaceCrossings.
/// Cost: linear in particles and triangles.
void ReplaceDrops(const DropsInput& input, const DropLimits& limits, Drops& drops,
                  std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                  std::vector<VertexTriangle>& triangles);

}  // namespace partiemc::space
