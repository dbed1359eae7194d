// Checks whether a running server serves, for the health checks of containers.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"
#include "common/address.h"

namespace partiemc::server {

/// Does not verify the server's certificate, so that any name of the server works. A check sends no
/// secret, and uses nothing of the response except the state.
struct HealthCheckSecurity {
  bool tls = false;
  /// PEM files for a server that requires client certificates, or empty.
  std::string certificate_file, key_file;
};

/// OK if the server at `address` serves. Errors: UNAVAILABLE; INVALID_ARGUMENT if a file of
/// `security` cannot be read. Each message is one line: problem, place, remedy. Blocks for at most
/// `timeout`.
absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout,
                         const HealthCheckSecurity& security = {});

}  // namespace partiemc::server
