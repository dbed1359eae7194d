// Asks a running server whether it serves: what a container's health check calls.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"
#include "common/address.h"

namespace partiemc::server {

/// A check tells the server nothing that is secret, and believes it nothing but that it serves: it
/// does not verify who the server is, so that it works by whatever name the server is asked.
struct HealthCheckSecurity {
  bool tls = false;
  /// Shown to a server that asks clients for a certificate; PEM files, or empty.
  std::string certificate_file, key_file;
};

/// OK if the server at `address` serves; otherwise a line that says what, where and why.
absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout,
                         const HealthCheckSecurity& security = {});

}  // namespace partiemc::server
