// Reports violated contracts of a target.
#pragma once

#include <string_view>

#include "absl/status/status.h"
#include "client/input/sequence.h"

namespace partiemc::fuzz {

/// Ends the process with a line about the violated promise unless `holds`, also in a build without
/// assertions.
void Require(bool holds, std::string_view promise);

/// Requires that `status` is OK.
void RequireOk(const absl::Status& status, std::string_view promise);

/// Requires that a refusal has field, value and rule.
void RequireViolation(const absl::Status& status);

/// Requires that a frame has as many ids, volumes and velocities as particles, or none.
void RequireSameCounts(const client::RecordedFrame& frame);

}  // namespace partiemc::fuzz
