// Compares the places of the particles with the planes and walls of the flags.
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

/// Finds slices that are beside the particles of all frames, and walls with most particles of a
/// frame behind them: probably a wrong coordinate or a wrong direction.
class ParticlePlaces {
 public:
  ParticlePlaces(const ReplayFlags& flags, const ReconstructionParameters& parameters);

  /// Cost: one pass over the particles for each slice; at most 1,000 particles
  /// for each wall, times its points.
  void Add(const RecordedFrame& frame);

  /// One line for each such slice, and one for the first frame with most particles behind walls.
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

  // The flag of the first wall that a position is behind; empty for none.
  std::string WallBefore(const double* position, int components) const;
  void CountBehindWalls(const RecordedFrame& frame);

  const ReconstructionParameters parameters_;
  std::vector<Range> slices_;
  std::string behind_walls_;  // The warning of walls; empty: none so far.
};

}  // namespace partiemc::client
