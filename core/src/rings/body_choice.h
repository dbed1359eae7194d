// Decides which bodies of a periodic box are whole, and which must be cut at its faces.
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

/// The result of ChooseBodies, and its warm buffers.
struct BodyChoice {
  std::vector<Fate> fates;  ///< By component.
  /// By component: the first component of the same body. If the body is not cut: the component.
  std::vector<std::uint32_t> bodies;

  // Scratch.
  std::vector<std::uint32_t> component_of;  // By particle, with the copies.
  std::vector<std::uint32_t> set;           // By component: a component of the same body.
  std::vector<std::uint64_t> given_count;   // By component: its particles without copies.
  std::vector<double> given_weight;         // By component: their summed weight; 0 if uniform.
  std::vector<std::uint8_t> has_copies;     // By component: of its set.
  std::vector<std::uint32_t> best;          // By set: the whole component that remains.
  std::vector<std::uint64_t> total;         // By set: its particles.
  std::vector<double> largest;              // By set: area of its largest image, squared cells.
};

struct BodyChoiceInput {
  const LiftedFrame& lifted;
  const Window& window;         ///< The box along the axes along which bodies percolate.
  std::array<double, 2> reach;  ///< Bodies are complete up to this far beyond it. World units.
  const ReconstructionParameters& parameters;
  double spacing, cell_size;  ///< World units.
  const ParticleBins& bins;
  const Crossings& crossings;
};

/// Decides the fate of each component of a frame with copies. Components that share a particle,
/// given or copied, are images of one body.
///   - A body without copies remains.
///   - Images of a body in the window and its margin of `reach` are complete. The one with the most
///     given particles remains, whole; of several the one with the lowest number.
///   - Otherwise the body percolates, or is too long: all its images are cut. In `topology`, their
///     particles are then the given ones. If the box wraps, this is so for all bodies.
///   - Bodies in different cells of the lattice may be joined in one image and apart in another. If
///     the chosen image lacks particles, all images are cut.
///   - Spray is gone (ReconstructionParameters::min_component_*): bodies with too few particles or
///     too little area. The area is the largest image's, or h^2 per particle if this is more.
///     TraceRings must have kept it.
/// Deterministic. Cost: linear in particles and segments.
void ChooseBodies(const BodyChoiceInput& input, BodyChoice& choice, RingTopology& topology);

}  // namespace partiemc
