// What is wrong with an input, in a form that a person can read and a program can act on.
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
  std::string value;   ///< The value as found: "nan", "12 bytes".
  std::string rule;    ///< What is asked: "must be finite".

  friend bool operator==(const Violation&, const Violation&) = default;
};

/// The reasons that the core gives. They are part of the public contract (proto/PROTOCOL.md):
/// a reason is never renamed and never given a second meaning.
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
inline constexpr std::string_view kReasonCorruptState = "CORRUPT_STATE";

/// A status of the given code whose message reads "field: value; rule" and which carries
/// `violation` as a payload, so that no shell has to parse the message.
absl::Status ViolationError(absl::StatusCode code, Violation violation);

/// The violation that `status` carries, if it was made by ViolationError.
std::optional<Violation> FindViolation(const absl::Status& status);

/// `value` in the shortest form that reads back the same: "0.1", "nan", "-inf".
std::string ShortestNumber(double value);

}  // namespace partiemc
