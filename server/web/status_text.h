// How a call ended, for whoever called through the gateway.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// One JSON object: `code` and `status`, and where they are known `reason`, `field`, `value`,
/// `rule` and `message` (proto/PROTOCOL.md, "Over WebSocket").
std::string StatusJson(const absl::Status& status);

/// The HTTP status that fits: 200 for OK, 400, 401, 403, 404, 409, 429, 499, 501, 503, 504, 500.
unsigned HttpStatusOf(const absl::Status& status);
/// "Not Found".
std::string HttpReasonOf(unsigned http_status);

/// What a WebSocket is closed with: 1000 for OK, else 4000 and the code.
std::uint16_t CloseCodeOf(const absl::Status& status);
/// The reason of its Violation, or the name of its code: at most 120 bytes.
std::string CloseReasonOf(const absl::Status& status);

}  // namespace partiemc::server
