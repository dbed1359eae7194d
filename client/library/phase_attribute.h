// Adds the attribute with the phases of particles to the attributes that a stream requests.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "partiemc/parameters.h"

namespace partiemc::client {

/// Returns `attributes`, and the phase attribute if a section or a wall is given by a phase. Frames
/// of the stream must have these attributes.
inline std::vector<std::string> WithPhases(const ReconstructionParameters& parameters,
                                           std::vector<std::string> attributes) {
  const bool has_phases = !parameters.wall_phases.empty() ||
                          std::ranges::any_of(parameters.sections, [](const Section& section) {
                            return section.phase.has_value();
                          });
  if (has_phases && std::ranges::find(attributes, parameters.phase_attribute) == attributes.end()) {
    attributes.push_back(parameters.phase_attribute);
  }
  return attributes;
}

}  // namespace partiemc::client
