// Asks a running server whether it serves: what a container's health check calls.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"
#include "server/address.h"

namespace partiemc::server {

/// OK if the server at `address` serves; otherwise a line that says what, where and why.
absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout);

}  // namespace partiemc::server
