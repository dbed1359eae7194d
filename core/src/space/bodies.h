// The bodies of a frame: connected sets of inside nodes.
//
// Inside nodes are connected along lattice edges only, because the surface separates inside corners
// of a cell that are not neighbours (cell_loops.h).
#pragma once

#include <cstdint>
#include <vector>

#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/bins.h"
#include "space/field.h"
#include "space/lattice.h"

namespace partiemc::space {

/// What remains of a body in a frame with copies of particles (space_images/body_images.h).
enum class BodyFate : std::uint8_t {
  kWhole,  ///< It remains as it is.
  kCut,    ///< Its part in the periodic box remains.
  kGone,   ///< Another image of the body remains.
};

struct Body {
  BrickPlace lowest{};          ///< One of its nodes with the smallest z.
  std::uint64_t particles = 0;  ///< Particles whose nearest inside node is in the body.
  std::uint64_t images = 0;     ///< The same for mirror images behind walls, or for copies.
  double volume = 0;            ///< Volume of these particles, world units cubed.
  BodyFate fate = BodyFate::kWhole;
  bool is_complete = false;  ///< It is cut, but this image lacks no part. Only in a box that wraps.
  /// The first body that is an image of the same body. ChooseImages gives all of them the particles
  /// and the volume of the whole body.
  std::uint32_t first_image = kNoIndex;
};

/// The body of particles whose body was dropped.
inline constexpr std::uint32_t kDroppedBody = kNoIndex - 1;

struct Bodies {
  std::vector<Body> bodies;

  /// A part of a body in one brick.
  struct Part {
    BrickBits nodes;
    std::uint32_t brick;
    std::uint32_t body;  // Index of the body; in JoinParts: the parent part.
  };
  std::vector<Part> parts;             ///< By brick.
  std::vector<std::uint32_t> first;    ///< Per brick: its first part, and the number of all parts.
  std::vector<std::int64_t> lowest_z;  ///< Scratch: by body.

  /// By particle of SpaceBins: its body, kDroppedBody, or kNoIndex if no inside node is near.
  std::vector<std::uint32_t> body_of_particle;

  bool IsCut(std::uint32_t body) const { return bodies[body].fate == BodyFate::kCut; }

  /// The body of an inside node.
  std::uint32_t BodyOf(const BrickPlace& node) const {
    std::uint32_t part = first[node.brick];
    while ((parts[part].nodes[node.k] >> node.Bit() & 1) == 0) ++part;
    return parts[part].body;
  }
};

/// Finds the bodies, in the order of their first parts, and counts their particles. `spacing` is in
/// world units; without volumes, each particle has the volume spacing^3.
void FindBodies(const Frame& frame, const SpaceBins& bins, const SpaceField& field, double spacing,
                Bodies& bodies);

}  // namespace partiemc::space
