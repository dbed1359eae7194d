// How a target says that a promise is broken.
#pragma once

#include <string_view>

#include "absl/status/status.h"

namespace partiemc::fuzz {

/// Ends the process with a line about the broken promise unless it holds, also in a build without
/// assertions.
void Require(bool holds, std::string_view promise);

/// Requires that `status` is OK.
void RequireOk(const absl::Status& status, std::string_view promise);

/// Requires that a refusal tells which field has which value against which rule.
void RequireViolation(const absl::Status& status);

}  // namespace partiemc::fuzz
