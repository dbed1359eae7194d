// grpc.health.v1.Health: whether this server serves, for probes, which have no token.
#pragma once

#include <atomic>

#include "server/compute/memory_budget.h"
#include "server/connections/connection_table.h"
#include "server/rpc/byte_service.h"
#include "server/security/authentication.h"
#include "server/stream/opening_calls.h"
#include "server/stream/unary_registry.h"

namespace partiemc::server {

/// Check alone. Its calls count like any other for information, so that strangers who make them and
/// send nothing hold no more than others. Watch is not served: gRPC's clients take that for a
/// server whose health is that of its connection, and whoever has a stream is told of a drain
/// there.
class HealthService final : public ByteService {
 public:
  /// The arguments outlive the service.
  HealthService(const Authentication& authentication, OpeningCalls& opening, UnaryRegistry& calls,
                MemoryBudget& budget, const ConnectionTable& connections);

  void SetServing(bool serving) { serving_ = serving; }

 private:
  std::atomic<bool> serving_ = false;
};

}  // namespace partiemc::server
