// The reasons of errors.
#pragma once

#include <string>

#include "partiemc/status.h"

namespace partiemc::support {

/// The reason in the violation of `status`; all of `status` if it has none.
inline std::string ReasonOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  return violation ? violation->reason : status.ToString();
}

}  // namespace partiemc::support
