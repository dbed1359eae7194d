// Whether a server could listen somewhere.
#pragma once

#include "absl/status/status.h"
#include "common/address.h"

namespace partiemc::server {

/// Tries to listen there and lets go at once: gRPC itself does not say why it could not, and would
/// take a Unix socket away from the server that owns it.
/// Errors: UNAVAILABLE, a line that says where, why and what to do.
absl::Status CheckCanListen(const Address& address);

}  // namespace partiemc::server
