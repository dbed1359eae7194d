// Frames of a faulty or malicious simulator.
#pragma once

#include <cstdint>
#include <vector>

#include "fuzz/choices.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc::fuzz {

/// Small enough for thousands of frames per second.
inline constexpr FrameLimits kHostileLimits{.max_particles = 256, .max_tiles = 48};

/// A frame that owns its arrays of difficult numbers.
class HostileFrame {
 public:
  /// `reach`: 0, or the number of spacings within which the particles of a frame in space lie
  /// around their origin, so that they make bodies.
  HostileFrame(Choices& choices, double spacing, int reach = 0);
  /// Valid while this object exists.
  Frame AsFrame() const;

 private:
  std::vector<double> doubles_;
  std::vector<float> floats_;
  bool is_float_ = false;
  int components_ = 2;
  std::vector<float> volumes_;
  std::vector<std::uint64_t> ids_;
  std::vector<float> velocities_;
  std::vector<float> phases_;
  std::vector<Attribute> attributes_;  ///< The phases, or none.
  double time_ = 0;
};

/// Parameters, mostly valid.
ReconstructionParameters HostileParameters(Choices& choices);

/// Reconstructs `frames` frames of `choices` as one stream from `state` on; requires the guarantees
/// of Reconstruct, Serialize and Validate.
void AttackStream(Choices& choices, const ReconstructionParameters& parameters, State state,
                  int frames);

}  // namespace partiemc::fuzz
