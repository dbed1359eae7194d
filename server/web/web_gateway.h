// The HTTP gateway of a server: serves the web page, and the server's methods over WebSocket and
// POST.
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

/// Runs in its own threads.
class WebGateway {
 public:
  /// The referenced objects must outlive the gateway. If `tls` is null, connections are not
  /// encrypted.
  struct Setup {
    const Methods& methods;
    const ServerLimits& limits;
    const CurrentTlsIdentity* tls = nullptr;
    /// Whether calls require a token.
    bool has_tokens = false;
    Metrics& metrics;
    std::function<bool()> draining;
    std::chrono::milliseconds ping_interval, ping_timeout;
  };

  /// Starts the gateway; it listens and serves when this returns. Errors: INVALID_ARGUMENT for a
  /// Unix socket or an invalid origin, UNAVAILABLE if it cannot listen.
  static absl::StatusOr<std::unique_ptr<WebGateway>> Start(const WebOptions& options,
                                                           const Setup& setup);
  /// Stops at once, unless Stop was called before.
  ~WebGateway();
  WebGateway(const WebGateway&) = delete;
  WebGateway& operator=(const WebGateway&) = delete;

  /// With the actual port.
  const Address& address() const;

  /// Stops accepting connections and closes the connections without a call. Waits until all others
  /// are closed. At the deadline, cuts the remaining connections.
  void Stop(std::chrono::steady_clock::time_point deadline);

 private:
  class Implementation;
  explicit WebGateway(std::unique_ptr<Implementation> implementation);

  const std::unique_ptr<Implementation> implementation_;
};

}  // namespace partiemc::server
