#include "frame/phase_values.h"

#include <cmath>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc {

absl::Status TakePhaseValues(const Frame& frame, const std::string& name,
                             std::span<const float>& phases, std::vector<Attribute>& others) {
  others.clear();
  phases = {};
  bool is_found = frame.ParticleCount() == 0;
  for (const Attribute& attribute : frame.attributes) {
    if (attribute.name != name) {
      others.push_back(attribute);
      continue;
    }
    is_found = true;
    const std::string field = "attributes[" + name + "]";
    if (attribute.components != 1) {
      return InvalidFrame(kReasonOutOfRange, field,
                          absl::StrCat(attribute.components, " components"),
                          "must be one number per particle: its phase");
    }
    for (std::size_t k = 0; k < attribute.values.size(); ++k) {
      const float value = attribute.values[k];
      if (value == std::floor(value)) continue;
      return InvalidFrame(kReasonOutOfRange, absl::StrCat(field, "[", k, "]"),
                          ShortestNumber(value), "must be a whole number: a phase");
    }
    phases = attribute.values;
  }
  if (is_found) return absl::OkStatus();
  return InvalidFrame(kReasonNoSuchAttribute, "attributes", name,
                      "must be an attribute of the frame: the phases of its particles");
}

}  // namespace partiemc
