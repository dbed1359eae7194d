// The end of a call in the formats of the gateway: JSON, HTTP status, close code.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// One JSON object: `code` and `status`, and where they are known `reason`, `field`, `value`,
/// `rule` and `message` (proto/PROTOCOL.md, "Over WebSocket").
std::string StatusJson(const absl::Status& status);

/// The HTTP status of `status`: 200 for OK, or 400, 401, 403, 404, 409, 429, 499, 501, 503, 504,
/// 500.
unsigned HttpStatusOf(const absl::Status& status);
/// "Not Found".
std::string HttpReasonOf(unsigned http_status);

/// The close code of a WebSocket: 1000 for OK, otherwise 4000 plus the gRPC code.
std::uint16_t CloseCodeOf(const absl::Status& status);
/// The reason of the Violation, or the name of the code; at most 120 bytes.
std::string CloseReasonOf(const absl::Status& status);

}  // namespace partiemc::server
