// Why the server ends calls of any kind.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// The reasons for which calls end (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonProtocol = "PROTOCOL";
inline constexpr std::string_view kReasonDraining = "DRAINING";
inline constexpr std::string_view kReasonTakenOver = "TAKEN_OVER";
inline constexpr std::string_view kReasonIdle = "IDLE";
/// Of a call, and of a frame, whose bytes are not the message that they should be.
inline constexpr std::string_view kReasonMalformed = "MALFORMED";

/// INVALID_ARGUMENT (PROTOCOL) for a request that may not come now.
absl::Status ProtocolError(std::string found, std::string rule);
/// UNAVAILABLE with the Violation that a draining server gives everybody.
absl::Status DrainingError();
/// CANCELLED: the client has disconnected.
absl::Status ClientGone();
/// DEADLINE_EXCEEDED (IDLE) for a client that did `what` for `limit`: "sends no `open`".
absl::Status IdleError(std::string what, std::chrono::milliseconds limit);

}  // namespace partiemc::server
