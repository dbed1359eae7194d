// Replaces the surfaces of drops by ellipsoids, which keep their volume and follow their particles.
//
// A drop is a body of few particles. Its level set encloses few nodes or none. Its surface depends
// on its position relative to the lattice, so its volume is wrong and it trembles as it moves. An
// ellipsoid with the moments of the particles avoids both. A drop keeps its surface if the box
// around the ellipsoid and one node of the drop touches the box of another surface
// (core/SURFACES.md, "Drops").
//
// Bodies that will surely become ellipsoids are found before vertices are placed (SettleDrops).
// They are settled: their vertices stay at their anchors, and certificate and volume steps leave
// them out. Their triangles need not be valid; ReplaceDrops removes them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/lattice.h"
#include "space/mesh.h"
#include "space_certificate/moved_nodes.h"

namespace partiemc::space {

struct DropLimits {
  /// Bodies with more particles keep their surfaces. 0: no ellipsoids.
  std::uint64_t most_particles = 0;
  /// Limits of cleaning (BodyLimits). Below them, a particle without a body gets no ellipsoid.
  std::uint64_t least_particles = 0;
  double least_volume = 0;  ///< World units cubed.
};

struct DropsInput {
  const Frame& frame;
  const SpaceBins& bins;
  const Scale& scale;
  const Bodies& bodies;
  const SpaceCrossings& crossings;
  const MovedNodes& nodes;
  std::span<const std::uint32_t> body_of;  ///< By vertex of SpaceCrossings.
  bool takes_copies = false;  ///< Copies without a body become drops, too. For boxes that wrap.
};

struct Drops {
  struct Box {
    Vec3 low, high;

    static Box Empty() {
      constexpr double kFar = std::numeric_limits<double>::infinity();
      return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    }
  };
  struct Drop {
    std::uint32_t body = kNoIndex;      ///< kNoIndex: a particle without a body.
    std::uint32_t particle = kNoIndex;  ///< Of SpaceBins: a particle without a body.
    std::uint64_t particles = 0;
    double volume = 0;   ///< Cells cubed; of its particles, images included.
    Vec3 origin, first;  ///< In cells: a point in the drop; the first moment about `origin`.
    /// Second moments xx, xy, xz, yy, yz, zz about `origin`, of the particles as balls. In cells.
    std::array<double, 6> second{};
    Box ellipsoid;  ///< Box around the ellipsoid. World units.
    /// A lattice node, which shows in which part of space the drop is. For a body: its lowest node.
    /// For a particle without a body: the lowest node of its cell, an outside node that has not
    /// moved. World units.
    Vec3 node;
    bool is_taken = false;           ///< The ellipsoid replaces the surface.
    std::uint32_t first_vertex = 0;  ///< First index in the positions, if it is taken.
  };
  std::vector<Drop> drops;               ///< First the bodies, then the particles without a body.
  std::vector<std::uint8_t> is_settled;  ///< By body. Empty: none is.

  bool IsSettled(std::uint32_t body) const { return !is_settled.empty() && is_settled[body] != 0; }

  std::vector<std::uint32_t> drop_of;  ///< Scratch: by body, or kNoIndex.
  std::vector<Vec3> points, normals;   ///< Scratch: of one ellipsoid, world units.
  struct Reach {
    std::uint32_t brick, drop;
    friend auto operator<=>(const Reach&, const Reach&) = default;
  };
  BrickDirectory bricks;               ///< Scratch: the bricks that boxes of drops reach.
  std::vector<Reach> reaches;          ///< Scratch: sorted by brick.
  std::vector<std::uint32_t> first;    ///< Scratch: by brick, its first index in `reaches`.
  std::vector<Box> surfaces;           ///< Scratch: by drop, around the surface of its body.
  std::vector<std::uint32_t> refused;  ///< Scratch: indices of drops that keep their surfaces.
};

/// Sets `is_settled`: bodies with an ellipsoid that ReplaceDrops will accept, unless a vertex of
/// another body leaves its cell and comes too near, which is rare. Does not use `input.nodes`.
/// Cost: linear in particles and active cells.
void SettleDrops(const DropsInput& input, const DropLimits& limits, Drops& drops);

/// Removes the triangles of the drops that ellipsoids replace (Drop::is_taken), and appends these
/// ellipsoids to positions, normals and triangles. World units. Returns false, and changes nothing
/// but `drops`, if it must refuse a settled body. Cost: linear in particles and triangles.
[[nodiscard]] bool ReplaceDrops(const DropsInput& input, const DropLimits& limits, Drops& drops,
                                std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                                std::vector<VertexTriangle>& triangles);

}  // namespace partiemc::space
