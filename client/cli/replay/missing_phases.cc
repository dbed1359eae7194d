#include "client/cli/replay/missing_phases.h"

#include <algorithm>
#include <utility>

#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Removes the phases that occur in `values`.
void RemoveThose(const std::vector<float>& values, std::vector<std::int32_t>& phases) {
  std::erase_if(phases, [&](std::int32_t phase) {
    return std::ranges::find(values, static_cast<float>(phase)) != values.end();
  });
}

}  // namespace

MissingPhases::MissingPhases(const ReconstructionParameters& parameters)
    : attribute_(parameters.phase_attribute), walls_(parameters.wall_phases) {
  for (const Section& section : parameters.sections) {
    if (section.phase) phases_.push_back(*section.phase);
  }
}

void MissingPhases::Remove(const RecordedFrame& frame) {
  if (phases_.empty() && walls_.empty()) return;
  for (const ParticleAttribute& attribute : frame.attributes) {
    if (attribute.name != attribute_) continue;
    RemoveThose(attribute.values, phases_);
    RemoveThose(attribute.values, walls_);
    return;  // A recording may hold a name twice; the first one is sent.
  }
}

std::vector<std::string> MissingPhases::Warnings() const {
  std::vector<std::string> warnings;
  for (const auto& [flag, missing] :
       {std::pair("--phases", &phases_), std::pair("--wall", &walls_)}) {
    if (missing->empty()) continue;
    std::string warning = Concat(flag, " ", attribute_, "=", missing->front());
    for (std::size_t k = 1; k < missing->size(); ++k) AppendAll(warning, ",", (*missing)[k]);
    warnings.push_back(warning + ": no particle has " +
                       (missing->size() == 1 ? "this value" : "one of these values"));
  }
  return warnings;
}

}  // namespace partiemc::client
