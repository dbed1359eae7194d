// Adds the attribute with the phases of particles to the attributes that a stream asks for.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "partiemc/parameters.h"

namespace partiemc::client {

/// The attributes that frames of a stream must have: those to interpolate, and the phases if a
/// section has one or walls have.
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
