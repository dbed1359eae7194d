// The phases of the particles of a frame.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/frame.h"

namespace partiemc {

/// Sets `phases` to the values of the attribute `name`, one whole number for each particle, and
/// `others` to the other attributes. Errors: INVALID_ARGUMENT if a frame with particles lacks the
/// attribute, or if its values are others. Requires: CheckFrame has passed the frame.
absl::Status TakePhaseValues(const Frame& frame, const std::string& name,
                             std::span<const float>& phases, std::vector<Attribute>& others);

}  // namespace partiemc
