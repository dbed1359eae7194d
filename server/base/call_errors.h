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

/// INVALID_ARGUMENT (PROTOCOL): the client has sent a request that is not allowed in the current
/// state of the call.
absl::Status ProtocolError(std::string found, std::string rule);
/// UNAVAILABLE with a Violation (DRAINING): the server is draining.
absl::Status DrainingError();
/// CANCELLED: the client has disconnected.
absl::Status ClientGone();
/// DEADLINE_EXCEEDED (IDLE) for a client that has done `what` for the time `limit`. Example of
/// `what`: "sends no `open`".
absl::Status IdleError(std::string what, std::chrono::milliseconds limit);

}  // namespace partiemc::server
