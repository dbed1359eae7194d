// grpc.health.v1.Health, for probes, which have no token.
#pragma once

#include <atomic>

#include "server/calls/server_context.h"
#include "server/connections/connection_table.h"
#include "server/rpc/byte_service.h"

namespace partiemc::server {

/// Serves Check, whose calls have separate slots (UnaryKind::kProbe). Does not serve Watch:
/// without it gRPC's clients derive the health from the connection, and streams receive drain
/// notices. Thread-safe.
class HealthService final : public ByteService {
 public:
  /// The arguments outlive the service.
  HealthService(const ServerContext& context, const ConnectionTable& connections);

  void SetServing(bool serving) { serving_ = serving; }

 private:
  std::atomic<bool> serving_ = false;
};

}  // namespace partiemc::server
