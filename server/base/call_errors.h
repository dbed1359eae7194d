// Reasons and errors that end calls of every kind.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// Reasons of the end of a call (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonProtocol = "PROTOCOL";
inline constexpr std::string_view kReasonDraining = "DRAINING";
inline constexpr std::string_view kReasonTakenOver = "TAKEN_OVER";
inline constexpr std::string_view kReasonIdle = "IDLE";
/// For a call or a frame with bytes that are not the expected message.
inline constexpr std::string_view kReasonMalformed = "MALFORMED";

/// INVALID_ARGUMENT (PROTOCOL) for a request that is not allowed in the call's state.
absl::Status ProtocolError(std::string found, std::string rule);
/// UNAVAILABLE with the Violation of a draining server.
absl::Status DrainingError();
/// CANCELLED: the client has disconnected.
absl::Status ClientGone();
/// DEADLINE_EXCEEDED (IDLE) for a client that did `what` for `limit`: "sends no `open`".
absl::Status IdleError(std::string what, std::chrono::milliseconds limit);

}  // namespace partiemc::server
