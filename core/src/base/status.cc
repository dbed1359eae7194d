#include "partiemc/status.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace partiemc {
namespace {

constexpr absl::string_view kPayloadType = "partiemc.v1/violation";

// Separates the parts of the payload. No part contains this character.
constexpr char kSeparator = '\x1f';

}  // namespace

absl::Status ViolationError(absl::StatusCode code, Violation violation) {
  absl::Status status(code,
                      absl::StrCat(violation.field, ": ", violation.value, "; ", violation.rule));
  const std::string separator(1, kSeparator);
  status.SetPayload(kPayloadType,
                    absl::Cord(absl::StrCat(violation.reason, separator, violation.field, separator,
                                            violation.value, separator, violation.rule)));
  return status;
}

std::optional<Violation> FindViolation(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayloadType);
  if (!payload.has_value()) return std::nullopt;
  const std::string text(*payload);
  std::vector<std::string> parts = absl::StrSplit(text, kSeparator);
  parts.resize(4);
  return Violation{std::move(parts[0]), std::move(parts[1]), std::move(parts[2]),
                   std::move(parts[3])};
}

std::string ShortestNumber(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
  return std::string(buffer, end);
}

}  // namespace partiemc
