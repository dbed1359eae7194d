// Serves metrics to Prometheus over HTTP.
#pragma once

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "common/address.h"
#include "server/telemetry/metrics.h"

namespace prometheus {
class Exposer;
}

namespace partiemc::server {

/// Serves all metrics at GET /metrics. Uses two threads until it is destroyed.
class MetricsEndpoint {
 public:
  /// Errors: INVALID_ARGUMENT for a Unix socket, UNAVAILABLE if it cannot listen.
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Listen(
      const Address& address, const std::shared_ptr<Metrics>& metrics);
  ~MetricsEndpoint();

  /// The address with its actual port.
  const Address& address() const { return address_; }

 private:
  MetricsEndpoint(Address address, std::unique_ptr<prometheus::Exposer> exposer);

  const Address address_;
  std::unique_ptr<prometheus::Exposer> exposer_;
};

}  // namespace partiemc::server
