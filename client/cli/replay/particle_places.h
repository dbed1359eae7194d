// Compares the places of the particles with the planes of slices.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "client/cli/replay_flags.h"
#include "client/input/sequence.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

/// Finds slices that are beside the particles of all frames. Their coordinate is probably wrong.
class ParticlePlaces {
 public:
  ParticlePlaces(const ReplayFlags& flags, const ReconstructionParameters& parameters);

  /// Cost: one pass over the particles for each slice.
  void Add(const RecordedFrame& frame);

  /// One line for each such slice.
  std::vector<std::string> Warnings() const;

 private:
  // A slice, and the range of the particles along its normal.
  struct Range {
    std::string text;  // Of the flag.
    std::string axis;  // "z", or "its normal" for a slanted plane.
    std::array<double, 3> normal;
    double plane;
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
  };

  const double reach_;  // The outline is half a spacing outside of the particles.
  std::vector<Range> slices_;
};

}  // namespace partiemc::client
