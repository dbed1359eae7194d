// Sets parameters by name, for language bindings and configuration files.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "partiemc/parameters.h"
#include "partiemc/status.h"

namespace partiemc::client {

/// Sets `parameter` to the element of `values` whose Name is `name`. `field` is the parameter's
/// name in errors. Errors: INVALID_ARGUMENT with a Violation (reason UNSUPPORTED) that lists all
/// names.
template <typename Value>
absl::Status SetByName(std::string_view field, std::string_view name, std::span<const Value> values,
                       Value& parameter) {
  std::string rule = "must be";
  for (const Value value : values) {
    if (Name(value) == name) {
      parameter = value;
      return absl::OkStatus();
    }
    rule.append(rule.size() > 7 ? ", " : " ").append(Name(value));
  }
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {"UNSUPPORTED", "parameters." + std::string(field), std::string(name), std::move(rule)});
}

inline absl::Status SetByName(std::string_view name, Output& output) {
  static constexpr std::array kAll = {Output::kOutline, Output::kSurface};
  return SetByName("output", name, std::span<const Output>(kAll), output);
}
inline absl::Status SetByName(std::string_view name, Placement& placement) {
  return SetByName("placement", name, AllPlacements(), placement);
}
inline absl::Status SetByName(std::string_view name, Fill& fill) {
  return SetByName("fill", name, AllFills(), fill);
}
inline absl::Status SetByName(std::string_view name, Plane& plane) {
  constexpr std::array kAll = {Plane::kXy, Plane::kXz, Plane::kYz};
  return SetByName("plane", name, std::span<const Plane>(kAll), plane);
}
inline absl::Status SetByName(std::string_view name, SpacingRule& rule) {
  constexpr std::array kAll = {SpacingRule::kFirstFrame, SpacingRule::kEveryFrame};
  return SetByName("spacing_rule", name, std::span<const SpacingRule>(kAll), rule);
}

}  // namespace partiemc::client
