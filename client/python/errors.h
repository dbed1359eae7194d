// Converts statuses to Python exceptions.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/status.h"

namespace partiemc::python {

/// Throws partiemc.Error for `status`, which must not be OK. Requires the GIL.
[[noreturn]] void Raise(const absl::Status& status);
/// Throws partiemc.Error for frame `sequence`, which the server refused. Requires the GIL.
[[noreturn]] void Raise(const std::string& message, const Violation& violation,
                        std::uint64_t sequence);

inline void RaiseUnlessOk(const absl::Status& status) {
  if (!status.ok()) Raise(status);
}

/// Returns INVALID_ARGUMENT with a Violation, for a wrong argument of a Python function.
absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                     std::string rule);

}  // namespace partiemc::python
