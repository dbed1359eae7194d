// The rules of phases in parameters.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc {

/// Checks that a phase is at most 2^24 in magnitude. Errors: INVALID_ARGUMENT for the parameter
/// `field`.
absl::Status CheckPhaseNumber(const std::string& field, std::int32_t phase);

/// Checks that the name of the attribute with the phases is printable ASCII and not empty.
/// `reason`: why the parameters need the attribute; part of the error.
absl::Status CheckPhaseAttribute(const std::string& name, const std::string& reason);

}  // namespace partiemc
