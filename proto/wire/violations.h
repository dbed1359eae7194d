// The codec's errors for messages that break a rule.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "wire/codec.h"

namespace partiemc::wire {

/// INVALID_ARGUMENT with a Violation.
inline absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                            std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

/// INVALID_ARGUMENT with a Violation (UNSUPPORTED) for the number of an enum value that this
/// version does not know.
inline absl::Status UnknownEnum(std::string field, int value) {
  return Invalid(kReasonUnsupported, std::move(field), absl::StrCat(value),
                 "must be a value that this version knows");
}

}  // namespace partiemc::wire
