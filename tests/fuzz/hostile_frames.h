// Frames that a simulator in trouble, or somebody with bad intentions, might send.
#pragma once

#include <cstdint>
#include <vector>

#include "fuzz/choices.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc::fuzz {

/// Small enough for thousands of frames a second.
inline constexpr FrameLimits kHostileLimits{.max_particles = 256, .max_tiles = 48};

/// A frame that owns its arrays, of numbers that are likely to hurt.
class HostileFrame {
 public:
  HostileFrame(Choices& choices, double spacing);
  /// Valid as long as this is.
  Frame AsFrame() const;

 private:
  std::vector<double> doubles_;
  std::vector<float> floats_;
  bool is_float_ = false;
  int components_ = 2;
  std::vector<float> volumes_;
  std::vector<std::uint64_t> ids_;
  std::vector<float> velocities_;
  double time_ = 0;
};

/// Parameters of which most are legal.
ReconstructionParameters HostileParameters(Choices& choices);

/// Reconstructs `frames` frames of `choices` as one stream that begins with `state` and requires
/// all that Reconstruct, Serialize and Validate promise.
void AttackStream(Choices& choices, const ReconstructionParameters& parameters, State state,
                  int frames);

}  // namespace partiemc::fuzz
