// Checks whether a running server is serving, for containers and probes.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"
#include "common/address.h"

namespace partiemc::server {

/// Security settings of a health check. The check does not verify the server's certificate, so it
/// works with any name of the server. This is safe: the check sends no secret, and uses only the
/// serving state of the response.
struct HealthCheckSecurity {
  bool tls = false;
  /// Paths of PEM files of a client certificate. Empty: no client certificate.
  std::string certificate_file, key_file;
};

/// Returns OK if the server at `address` is serving. Errors: UNAVAILABLE; INVALID_ARGUMENT if a
/// file of `security` cannot be read. Each message is one line: problem, place, remedy. Blocks for
/// at most `timeout`.
absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout,
                         const HealthCheckSecurity& security = {});

}  // namespace partiemc::server
