// Decides which bodies of a periodic box stay whole, and which are cut at its faces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "periodic/lift.h"
#include "rings/percolation.h"
#include "rings/rings.h"

namespace partiemc {

/// The result of ChooseBodies, and its scratch. A set has the images of one body; its root is its
/// first component.
struct BodyChoice {
  std::vector<Fate> fates;  ///< By component.
  /// By component: if the body is cut, its first component, else the component itself.
  std::vector<std::uint32_t> bodies;

  // Scratch.
  std::vector<std::uint32_t> component_of;  // By particle, with the copies.
  std::vector<std::uint32_t> set;           // By component: its parent in the set (union-find).
  std::vector<std::uint64_t> given_count;   // By component: its given particles.
  std::vector<double> given_weight;         // By component: summed weight of its given particles;
                                            // 0 if weights are uniform.
  std::vector<std::uint8_t> has_copies;     // By component: whether it has copied particles; at a
                                            // root: whether its set has.
  std::vector<std::uint32_t> best;          // By root: the component that stays whole.
  std::vector<std::uint64_t> total;         // By root: particles of the body.
  std::vector<double> own_area;             // With own sizes, by root: sum of h_i^2 over the
                                            // particles of the body, world units.
  std::vector<double> largest;              // By root: area of the largest image, squared cells.
};

struct BodyChoiceInput {
  const LiftedFrame& lifted;
  const Window& window;         ///< The box along the axes along which bodies percolate.
  std::array<double, 2> reach;  ///< World units: images up to this beyond `window` are complete.
  const ReconstructionParameters& parameters;
  double spacing, cell_size;  ///< World units.
  const ParticleBins& bins;
  const Crossings& crossings;
};

/// Decides the fate of each component of a frame with copies. Components that share a particle,
/// given or copied, are images of one body.
/// - Spray goes: bodies below ReconstructionParameters::min_component_*. Their area is the largest
///   image's, or h^2 (with own sizes h_i^2) per particle if this is more.
/// - If the box wraps, all other bodies are cut.
/// - A body without copies stays whole.
/// - An image that lies in the window, widened by `reach`, is complete. Of the complete images, the
///   one with the most given particles stays whole; ties: the lowest component. The others go.
/// - If no image is complete, the body percolates or is too long: all its images are cut.
/// - If the chosen image lacks particles of the body, or has a particle and its copy, all images
///   are cut, too. Bodies less than a cell apart may be one component in one image and two in
///   another.
/// In `topology`, the images of cut bodies keep only their given particles, and spray is counted.
/// Requires: TraceRings has kept the spray. Cost: linear in particles and segments.
void ChooseBodies(const BodyChoiceInput& input, BodyChoice& choice, RingTopology& topology);

}  // namespace partiemc
