// partiemc.v1.ReconstructionService over gRPC's callback API.
#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "server/authentication.h"
#include "server/compute_pool.h"
#include "server/limits.h"
#include "server/memory_budget.h"
#include "server/stream_registry.h"
#include "server/watch_pump.h"
#include "server/watch_registry.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a ReconstructFrame too many (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyCalls = "TOO_MANY_CALLS";

/// The generated service, in which Reconstruct and WatchStream pass messages as bytes.
using ServiceBase = v1::ReconstructionService::WithRawCallbackMethod_Reconstruct<
    v1::ReconstructionService::WithCallbackMethod_ReconstructFrame<
        v1::ReconstructionService::WithRawCallbackMethod_WatchStream<
            v1::ReconstructionService::WithCallbackMethod_ListStreams<
                v1::ReconstructionService::WithCallbackMethod_GetServerInfo<
                    v1::ReconstructionService::Service>>>>>;

/// Every method authenticates its caller first (server/call_guard.h).
class Service final : public ServiceBase {
 public:
  /// The arguments outlive the service.
  Service(const ServerLimits& limits, const Authentication& authentication,
          StreamRegistry& registry, MemoryBudget& budget, ComputePool& pool,
          WatchRegistry& watchers, WatchPump& pump)
      : limits_(limits),
        authentication_(authentication),
        registry_(registry),
        budget_(budget),
        pool_(pool),
        watchers_(watchers),
        pump_(pump) {}

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Reconstruct(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* ReconstructFrame(grpc::CallbackServerContext* context,
                                             const v1::ReconstructFrameRequest* request,
                                             v1::ReconstructFrameResponse* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* WatchStream(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* ListStreams(grpc::CallbackServerContext* context,
                                        const v1::ListStreamsRequest* request,
                                        v1::ListStreamsResponse* response) override;
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  // Errors: UNAVAILABLE (DRAINING), RESOURCE_EXHAUSTED (TOO_MANY_CALLS, MEMORY_BUDGET); else it
  // counts, with its bytes.
  absl::Status LetCallIn(std::uint64_t bytes);

  const ServerLimits& limits_;
  const Authentication& authentication_;
  StreamRegistry& registry_;
  MemoryBudget& budget_;
  ComputePool& pool_;
  WatchRegistry& watchers_;
  WatchPump& pump_;
  std::atomic<std::uint32_t> calls_ = 0;  // Of ReconstructFrame, going on.
};

}  // namespace partiemc::server
