// partiemc.v1.ReconstructionService over gRPC's callback API, every method as a stream of bytes.
#pragma once

#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/rpc/byte_service.h"
#include "server/rpc/call_guard.h"
#include "server/rpc/unary_reactor.h"
#include "server/security/authentication.h"
#include "server/security/checkpoint_keys.h"
#include "server/stream/limits.h"
#include "server/stream/opening_calls.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_registry.h"

namespace partiemc::server {

/// Every method admits its caller first (server/rpc/call_guard.h), before anything of a request is
/// read.
class Service final : public ByteService {
 public:
  /// The arguments outlive the service.
  Service(const ServerLimits& limits, const Authentication& authentication, OpeningCalls& opening,
          StreamRegistry& registry, UnaryRegistry& calls, MemoryBudget& budget, ComputePool& pool,
          WatchRegistry& watchers, WatchDispatcher& dispatcher,
          const CurrentCheckpointKeys& checkpoint_keys);

 private:
  Reactor* ReconstructFrame(grpc::CallbackServerContext& context);
  // A call for information: `answer` makes its response, on gRPC's own thread.
  template <typename Request, typename Answer>
  Reactor* Information(grpc::CallbackServerContext& context, Permission permission, Answer answer);
  absl::StatusOr<v1::ListStreamsResponse> ListStreams(const v1::ListStreamsRequest& request,
                                                      const Caller& caller) const;
  v1::GetServerInfoResponse GetServerInfo() const;

  const ServerLimits& limits_;
  const Authentication& authentication_;
  OpeningCalls& opening_;
  StreamRegistry& registry_;
  UnaryRegistry& calls_;
  MemoryBudget& budget_;
  ComputePool& pool_;
  WatchRegistry& watchers_;
  WatchDispatcher& dispatcher_;
  const CurrentCheckpointKeys& checkpoint_keys_;
};

}  // namespace partiemc::server
