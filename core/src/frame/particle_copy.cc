#include "frame/particle_copy.h"

#include <cstddef>

namespace partiemc {

void ParticleCopy::Take(const Frame& frame, std::span<const std::uint32_t> sources) {
  time_ = frame.time;
  volumes_.clear();
  ids_.clear();
  for (const std::uint32_t k : sources) {
    if (!frame.volumes.empty()) volumes_.push_back(frame.volumes[k]);
    if (!frame.ids.empty()) ids_.push_back(frame.ids[k]);
  }
  attributes_.clear();
  if (values_.size() < frame.attributes.size()) values_.resize(frame.attributes.size());
  for (std::size_t a = 0; a < frame.attributes.size(); ++a) {
    const Attribute& attribute = frame.attributes[a];
    std::vector<float>& values = values_[a];
    values.clear();
    for (const std::uint32_t k : sources) {
      const auto of_particle =
          attribute.values.subspan(k * static_cast<std::size_t>(attribute.components),
                                   static_cast<std::size_t>(attribute.components));
      values.insert(values.end(), of_particle.begin(), of_particle.end());
    }
    attributes_.push_back({attribute.name, attribute.components, values});
  }
}

void ParticleCopy::View(Frame& frame) const {
  frame.volumes = volumes_;
  frame.ids = ids_;
  frame.attributes = attributes_;
  frame.time = time_;
}

}  // namespace partiemc
