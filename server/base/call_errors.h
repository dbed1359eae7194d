// Reasons and errors that can end a call of any method.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// Reasons for which a call ends (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonProtocol = "PROTOCOL";
inline constexpr std::string_view kReasonDraining = "DRAINING";
inline constexpr std::string_view kReasonTakenOver = "TAKEN_OVER";
inline constexpr std::string_view kReasonIdle = "IDLE";
/// Reason for ending a call or refusing a frame whose bytes are not the expected message.
inline constexpr std::string_view kReasonMalformed = "MALFORMED";

/// INVALID_ARGUMENT (PROTOCOL): the current state of the call does not allow the client's request.
/// `found` and `rule` become the value and the rule of the Violation.
absl::Status ProtocolError(std::string found, std::string rule);
/// UNAVAILABLE with a Violation (DRAINING): the server is draining.
absl::Status DrainingError();
/// CANCELLED: the client has disconnected or cancelled the call.
absl::Status ClientGone();
/// DEADLINE_EXCEEDED (IDLE): the client has kept the call waiting for the time `limit`. `what`
/// completes the sentence "The client ...": "sends no `open`". `rule` becomes the rule of the
/// Violation.
absl::Status IdleError(std::string what, std::chrono::milliseconds limit,
                       std::string rule = "must do so within this time; call again");

}  // namespace partiemc::server
