// grpc.health.v1.Health, for probes, which have no token.
#pragma once

#include <atomic>

#include "server/calls/server_context.h"
#include "server/connections/connection_table.h"
#include "server/rpc/byte_service.h"

namespace partiemc::server {

/// Serves only the method Check, whose calls have separate slots (UnaryKind::kProbe). Does not
/// serve the method Watch: without it gRPC's clients derive the health of the server from the state
/// of the connection, and streams receive drain notices anyway. Thread-safe.
class HealthService final : public ByteService {
 public:
  /// The arguments outlive the service.
  HealthService(const ServerContext& context, const ConnectionTable& connections);

  void SetServing(bool serving) { serving_ = serving; }

 private:
  std::atomic<bool> serving_ = false;
};

}  // namespace partiemc::server
