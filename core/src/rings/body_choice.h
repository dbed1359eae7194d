// Decides which bodies of a periodic box are whole, and which must be cut at its faces.
#pragma once

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
};

struct BodyChoiceInput {
  const LiftedFrame& lifted;
  const Window& window;  ///< The box along the axes along which bodies percolate.
  double reach;          ///< Bodies are complete up to this far beyond the window. World units.
  bool wraps;            ///< Every body is cut.
  double cell_size;      ///< World units.
  const ParticleBins& bins;
  const Crossings& crossings;
};

/// Decides the fate of each component of a frame with copies. Components that share a particle,
/// given or copied, are images of one body.
///   - A body without copies remains.
///   - If images of a body lie in the window and its margin of `reach`, they are whole: the image
///     with the most given particles remains, of several the one with the lowest number.
///   - Otherwise the body percolates, or is too long: all its images are cut. In `topology`, their
///     particles are then the given ones. If `wraps`, this is so for all bodies.
/// Deterministic. Cost: linear in particles and segments.
void ChooseBodies(const BodyChoiceInput& input, BodyChoice& choice, RingTopology& topology);

}  // namespace partiemc
