// The bodies of a frame: connected sets of inside nodes.
//
// Inside nodes are connected along lattice edges only, because the surface separates the inside
// corners of a face that are not neighbours (cell_loops.h).
#pragma once

#include <cstdint>
#include <vector>

#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/bins.h"
#include "space/field.h"
#include "space/lattice.h"

namespace partiemc::space {

/// The part of a body that remains in the result. Set by ChooseImages for frames with copies of
/// particles.
enum class BodyFate : std::uint8_t {
  kWhole,  ///< All of it.
  kCut,    ///< The part in the periodic box.
  /// None, because another image of the same body remains. `virtual-plane` places the vertices of
  /// the image, so that the surfaces around all images move alike. The others drop it before.
  kGone,
};

struct Body {
  BrickPlace lowest{};          ///< One of its nodes with the smallest z.
  std::uint64_t particles = 0;  ///< Number of its particles, without images.
  std::uint64_t copies = 0;     ///< Number of its particles that are copies.
  bool has_mirrors = false;     ///< Whether some of its particles are mirror images (SpaceBins).
  double volume = 0;            ///< Volume of `particles`, world units cubed.
  BodyFate fate = BodyFate::kWhole;
  /// Whether this image of a cut body has all particles of the body. Set only in a box that wraps.
  bool is_complete = false;
  /// For a cut image: the smallest index among all images of the body. For a gone image: the image
  /// that remains. Else its own index. ChooseImages gives all images the particles and the volume
  /// of the whole body.
  std::uint32_t first_image = kNoIndex;
};

/// Marks the particles of dropped bodies in `body_of_particle`.
inline constexpr std::uint32_t kDroppedBody = kNoIndex - 1;

struct Bodies {
  std::vector<Body> bodies;

  /// A connected set of inside nodes of one brick.
  struct Part {
    BrickBits nodes;
    std::uint32_t brick;
    std::uint32_t body;  // Index of the body; in JoinParts: the parent part.
  };
  std::vector<Part> parts;             ///< Sorted by brick.
  std::vector<std::uint32_t> first;    ///< By brick: its first part; then the number of parts.
  std::vector<std::int64_t> lowest_z;  ///< Scratch: by body.

  /// By particle of SpaceBins, images included: its body, kDroppedBody, or kNoIndex if no inside
  /// node is near.
  std::vector<std::uint32_t> body_of_particle;

  bool IsCut(std::uint32_t body) const { return bodies[body].fate == BodyFate::kCut; }
  bool IsGone(std::uint32_t body) const { return bodies[body].fate == BodyFate::kGone; }

  /// The body of an inside node.
  std::uint32_t BodyOf(const BrickPlace& node) const {
    std::uint32_t part = first[node.brick];
    while ((parts[part].nodes[node.k] >> node.Bit() & 1) == 0) ++part;
    return parts[part].body;
  }
};

/// Finds the bodies, in the order of their first parts, and counts their particles. A particle
/// belongs to the body of the nearest inside corner of its cell. If no corner is inside, it belongs
/// to the body of the nearest inside node in the first layer of nodes around the cell, else in the
/// second layer, else to no body. With own sizes its kernel must reach a node of the layers.
/// `spacing` is in world units; without volumes, each particle has the volume spacing^3.
/// `kernel_radius` is in cells, of a particle of the spacing.
void FindBodies(const Frame& frame, const SpaceBins& bins, const SpaceField& field, double spacing,
                double kernel_radius, Bodies& bodies);

}  // namespace partiemc::space
