// Finds phases of the flags that no particle has.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/input/sequence.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

/// Phases of --phases and of --wall NAME=N that no particle of the given frames has: probably a
/// wrong number.
class MissingPhases {
 public:
  explicit MissingPhases(const ReconstructionParameters& parameters);

  /// Removes the phases of the frame's particles. Cost: one pass over the particles while a phase
  /// is missing, then nothing.
  void Remove(const RecordedFrame& frame);

  /// One line for each flag with missing phases.
  std::vector<std::string> Warnings() const;

 private:
  const std::string attribute_;
  std::vector<std::int32_t> phases_, walls_;  // Missing phases of --phases, of --wall.
};

}  // namespace partiemc::client
