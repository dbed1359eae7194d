// Statuses as exceptions of Python.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/status.h"

namespace partiemc::python {

/// Throws partiemc.Error for `status`, which is not OK. With the GIL.
[[noreturn]] void Raise(const absl::Status& status);
/// Of frame `sequence`, refused by the server.
[[noreturn]] void Raise(const std::string& message, const Violation& violation,
                        std::uint64_t sequence);

inline void RaiseUnlessOk(const absl::Status& status) {
  if (!status.ok()) Raise(status);
}

/// INVALID_ARGUMENT with a Violation: what the caller has given is of the wrong kind.
absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                     std::string rule);

}  // namespace partiemc::python
