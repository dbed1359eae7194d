// Sets parameters and outputs by name, for language bindings and configuration files.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "partiemc/client/stream.h"
#include "partiemc/parameters.h"
#include "partiemc/status.h"

namespace partiemc::client {

/// The name used on command lines and in language bindings.
constexpr std::string_view Name(Coordinates coordinates) {
  switch (coordinates) {
    case Coordinates::kFloat64:
      return "float64";
    case Coordinates::kRelativeFloat32:
      return "float32";
    case Coordinates::kCompact:
      return "compact";
  }
  return "";
}

/// Sets `parameter` to the element of `values` whose Name is `name`. `field` is the field in
/// errors. Errors: INVALID_ARGUMENT with a Violation (reason UNSUPPORTED) that lists all
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
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {"UNSUPPORTED", std::string(field), std::string(name), std::move(rule)});
}

inline absl::Status SetByName(std::string_view name, Output& output) {
  static constexpr std::array kAll = {Output::kOutline, Output::kSurface};
  return SetByName("parameters.output", name, std::span<const Output>(kAll), output);
}
inline absl::Status SetByName(std::string_view name, Placement& placement) {
  return SetByName("parameters.placement", name, AllPlacements(), placement);
}
inline absl::Status SetByName(std::string_view name, Fill& fill) {
  return SetByName("parameters.fill", name, AllFills(), fill);
}
inline absl::Status SetByName(std::string_view name, Plane& plane) {
  constexpr std::array kAll = {Plane::kXy, Plane::kXz, Plane::kYz};
  return SetByName("parameters.plane", name, std::span<const Plane>(kAll), plane);
}
inline absl::Status SetByName(std::string_view name, SpacingRule& rule) {
  constexpr std::array kAll = {SpacingRule::kFirstFrame, SpacingRule::kEveryFrame};
  return SetByName("parameters.spacing_rule", name, std::span<const SpacingRule>(kAll), rule);
}
inline absl::Status SetByName(std::string_view name, Sizes& sizes) {
  static constexpr std::array kAll = {Sizes::kEqual, Sizes::kOwn};
  return SetByName("parameters.sizes", name, std::span<const Sizes>(kAll), sizes);
}
inline absl::Status SetByName(std::string_view name, Boundary& boundary) {
  static constexpr std::array kAll = {Boundary::kBulk, Boundary::kGrains};
  return SetByName("parameters.boundary", name, std::span<const Boundary>(kAll), boundary);
}
inline absl::Status SetByName(std::string_view name, Coordinates& coordinates) {
  static constexpr std::array kAll = {Coordinates::kFloat64, Coordinates::kRelativeFloat32,
                                      Coordinates::kCompact};
  return SetByName("outputs.coordinates", name, std::span<const Coordinates>(kAll), coordinates);
}

}  // namespace partiemc::client
