// Follows bodies by the ids and velocities of their particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/piece_relations.h"
#include "partiemc/frame.h"
#include "partiemc/surface_state.h"
#include "space/bins.h"
#include "space_identities/shell_runs.h"

namespace partiemc::space {

/// Samples of a frame, and warm buffers.
struct ShellTracks {
  std::vector<ShellSample> samples;             ///< By number; ShellSample::shell is a number.
  std::vector<FoundSample<ShellPieces>> found;  ///< By `before`, then `now`.

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
