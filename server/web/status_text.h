// Writes the end of a call in the formats of the gateway: JSON, HTTP status, WebSocket close code.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// Returns a JSON object with `code` and `status`, and with `reason`, `field`, `value`, `rule` and
/// `message` if they are known (proto/PROTOCOL.md, "Over WebSocket").
std::string StatusJson(const absl::Status& status);

/// Returns the HTTP status for `status`: 200 for OK, otherwise one of 400, 401, 403, 404, 409, 429,
/// 499, 500, 501, 503, 504.
unsigned HttpStatusOf(const absl::Status& status);
/// Returns the reason phrase of an HTTP status, such as "Not Found".
std::string HttpReasonOf(unsigned http_status);

/// Returns the close code of a WebSocket: 1000 for OK, otherwise 4000 plus the number of the gRPC
/// code.
std::uint16_t CloseCodeOf(const absl::Status& status);
/// Returns the reason of the status's Violation, or the name of the code if it has no Violation;
/// empty for OK. At most 120 bytes.
std::string CloseReasonOf(const absl::Status& status);

}  // namespace partiemc::server
