// Follows bodies by the ids and velocities of their particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/surface_state.h"
#include "space/bins.h"
#include "space_identities/shell_runs.h"

namespace partiemc::space {

/// A displacement in whole cells.
struct NodeShift {
  std::int64_t x = 0, y = 0, z = 0;
  friend bool operator==(const NodeShift&, const NodeShift&) = default;
};

/// A sample of the last frame whose particle is in a body of this frame.
struct FoundShellSample {
  std::uint32_t before = 0, now = 0;  ///< Its shells: index in the history; number in this frame.
  NodeShift displacement;             ///< Since the last frame.
};

/// Samples of a frame, and warm buffers.
struct ShellTracks {
  std::vector<ShellSample> samples;     ///< By number; ShellSample::shell is a number.
  std::vector<FoundShellSample> found;  ///< By `before`, then `now`.

  // Scratch.
  std::vector<std::uint32_t> first_sample, sample_count;  // By number.
  std::vector<std::uint32_t> bucket;                      // HashIndex of the last samples.
  std::vector<std::uint64_t> known;                       // Bits of KnownHashes.
  struct Sum {
    std::int64_t x, y, z;
  };
  std::vector<Sum> velocity;  // By number.
};

/// If the frame has ids, samples the bodies and finds the samples of the last frame. If it has
/// velocities, sets the mean velocity of each body.
///
/// The samples of a body are its kMaxSamples particles with the smallest hashes of their ids, as
/// for rings (identities/ring_samples.h). The means come from sums of integers. So no value depends
/// on the order of the particles.
/// Requires: a checked frame; the velocities of `shells` are 0. Cost: linear in particles.
void FollowShells(const Frame& frame, const SpaceBins& bins, const ShellHistory& previous,
                  NumberedShells& shells, ShellTracks& tracks);

}  // namespace partiemc::space
