// The rules of phases in parameters.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc {

/// Checks the number of a phase. Errors: INVALID_ARGUMENT for the parameter `field`.
absl::Status CheckPhaseNumber(const std::string& field, std::int32_t phase);

/// Checks the name of the attribute of phases. `reason`: why the parameters need it.
absl::Status CheckPhaseAttribute(const std::string& name, const std::string& reason);

}  // namespace partiemc
