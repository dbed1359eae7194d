// What each method of partiemc.v1.ReconstructionService does, whatever carries its messages.
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/admission.h"
#include "server/calls/byte_call.h"
#include "server/calls/call_channel.h"
#include "server/calls/call_meters.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/relay/relay.h"
#include "server/security/authentication.h"
#include "server/security/checkpoint_keys.h"
#include "server/stream/limits.h"
#include "server/stream/opening_calls.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/telemetry/metrics.h"
#include "server/watch/result_history.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_registry.h"

namespace partiemc::server {

/// Safe from any thread.
class Methods {
 public:
  enum class Method { kReconstruct, kReconstructFrame, kWatchStream, kListStreams, kGetServerInfo };
  static constexpr std::array kAll = {Method::kReconstruct, Method::kReconstructFrame,
                                      Method::kWatchStream, Method::kListStreams,
                                      Method::kGetServerInfo};

  /// As in the .proto.
  static std::string_view Name(Method method);

  /// The arguments live longer, and so do the methods than their calls. Without a `relay` there are
  /// only the streams of this server.
  Methods(const ServerLimits& limits, const Authentication& authentication, OpeningCalls& opening,
          StreamRegistry& registry, UnaryRegistry& calls, MemoryBudget& budget, ComputePool& pool,
          WatchRegistry& watchers, WatchDispatcher& dispatcher, const HistoryRoom& history,
          const CurrentCheckpointKeys& checkpoint_keys, Metrics& metrics, Relay* relay);

  /// A call of `method` begins: admits its caller, before anything of a request is read, and has
  /// `channel` read, or end the call if it is refused.
  std::unique_ptr<ByteCall> Begin(Method method, CallChannel& channel,
                                  const CallOrigin& origin) const;

 private:
  std::unique_ptr<ByteCall> ReconstructFrame(CallChannel& channel, const CallOrigin& origin) const;
  // A call for information: `answer` makes its response, on the transport's own thread.
  template <typename Request, typename Answer>
  std::unique_ptr<ByteCall> Information(Method method, CallChannel& channel,
                                        const CallOrigin& origin, Permission permission,
                                        Answer answer) const;
  absl::StatusOr<v1::ListStreamsResponse> ListStreams(const v1::ListStreamsRequest& request,
                                                      const Caller& caller) const;
  void AddRemoteStreams(const std::string& after, std::size_t page_size, const Caller& caller,
                        v1::ListStreamsResponse& response) const;
  v1::GetServerInfoResponse GetServerInfo() const;

  const MethodMeters* Meters(Method method) const { return &meters_.Of(Name(method)); }

  const ServerLimits& limits_;
  const Authentication& authentication_;
  OpeningCalls& opening_;
  StreamRegistry& registry_;
  UnaryRegistry& calls_;
  MemoryBudget& budget_;
  ComputePool& pool_;
  WatchRegistry& watchers_;
  WatchDispatcher& dispatcher_;
  const HistoryRoom& history_;
  Relay* const relay_;
  const CurrentCheckpointKeys& checkpoint_keys_;
  const CallMeters meters_;
};

}  // namespace partiemc::server
