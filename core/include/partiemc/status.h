// Errors about an input, for people and programs.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc {

/// One broken rule: which field, which value it had, and the rule that it breaks.
struct Violation {
  std::string reason;  ///< Stable, upper case, for programs: "NOT_FINITE", "BYTE_COUNT", ...
  std::string field;   ///< Path of the field: "positions[17].x", "parameters.kernel_radius".
  std::string value;   ///< The actual value: "nan", "12 bytes".
  std::string rule;    ///< The requirement: "must be finite".

  friend bool operator==(const Violation&, const Violation&) = default;
};

/// The reasons of the core, which are part of the public contract (proto/PROTOCOL.md): a reason is
/// never renamed or reused with another meaning.
inline constexpr std::string_view kReasonOutOfRange = "OUT_OF_RANGE";
inline constexpr std::string_view kReasonNotFinite = "NOT_FINITE";
inline constexpr std::string_view kReasonCount = "COUNT";
inline constexpr std::string_view kReasonNoSuchAttribute = "NO_SUCH_ATTRIBUTE";
inline constexpr std::string_view kReasonDuplicate = "DUPLICATE";
inline constexpr std::string_view kReasonTooManyParticles = "TOO_MANY_PARTICLES";
inline constexpr std::string_view kReasonTooManyTiles = "TOO_MANY_TILES";
inline constexpr std::string_view kReasonOutOfMemory = "OUT_OF_MEMORY";
inline constexpr std::string_view kReasonNotPlanar = "NOT_PLANAR";
inline constexpr std::string_view kReasonResolution = "RESOLUTION";
inline constexpr std::string_view kReasonPercolates = "PERCOLATES";
inline constexpr std::string_view kReasonCorruptState = "CORRUPT_STATE";

/// Makes a status with the message "field: value; rule" and `violation` as payload, so that no
/// caller has to parse the message.
absl::Status ViolationError(absl::StatusCode code, Violation violation);

/// Returns the violation in a status that ViolationError made; nothing for any other status.
std::optional<Violation> FindViolation(const absl::Status& status);

/// Formats a number in the shortest form that reads back the same: "0.1", "nan", "-inf".
std::string ShortestNumber(double value);

}  // namespace partiemc
