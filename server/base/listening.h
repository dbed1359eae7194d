// Checks whether the server can listen on an address.
#pragma once

#include "absl/status/status.h"
#include "common/address.h"

namespace partiemc::server {

/// Listens on `address` and stops at once. gRPC reports no reason for a failure, and would remove
/// the Unix socket of a running server. Errors: UNAVAILABLE with one line: address, cause and
/// remedy.
absl::Status CheckCanListen(const Address& address);

}  // namespace partiemc::server
