// The gateway of a server: its page, and its methods over WebSocket and POST.
#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "common/address.h"
#include "server/calls/methods.h"
#include "server/security/tls_identity.h"
#include "server/stream/limits.h"
#include "server/telemetry/metrics.h"
#include "server/web/web_options.h"

namespace partiemc::server {

/// Runs in threads of its own.
class WebGateway {
 public:
  /// What is passed by reference lives longer. Without `tls` it speaks in the clear.
  struct Setup {
    const Methods& methods;
    const ServerLimits& limits;
    const CurrentTlsIdentity* tls = nullptr;
    Metrics& metrics;
    std::function<bool()> draining;
    std::chrono::milliseconds ping_interval, ping_timeout;
  };

  /// Listens and serves when it returns.
  /// Errors: INVALID_ARGUMENT for a Unix socket and for what is no origin, UNAVAILABLE where it
  /// cannot listen.
  static absl::StatusOr<std::unique_ptr<WebGateway>> Start(const WebOptions& options,
                                                           const Setup& setup);
  /// Stops at once if it was not stopped.
  ~WebGateway();
  WebGateway(const WebGateway&) = delete;
  WebGateway& operator=(const WebGateway&) = delete;

  /// With the port that it got.
  const Address& address() const;

  /// Takes no new connection, and returns when all calls are over and all connections are closed,
  /// those that are not by then are cut.
  void Stop(std::chrono::steady_clock::time_point deadline);

 private:
  class Implementation;
  explicit WebGateway(std::unique_ptr<Implementation> implementation);

  const std::unique_ptr<Implementation> implementation_;
};

}  // namespace partiemc::server
