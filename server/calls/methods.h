// The methods of partiemc.v1.ReconstructionService, over any channel.
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
#include "server/calls/server_context.h"
#include "server/telemetry/metrics.h"

namespace partiemc::server {

/// Thread-safe.
class Methods {
 public:
  enum class Method { kReconstruct, kReconstructFrame, kWatchStream, kListStreams, kGetServerInfo };
  static constexpr std::array kAll = {Method::kReconstruct, Method::kReconstructFrame,
                                      Method::kWatchStream, Method::kListStreams,
                                      Method::kGetServerInfo};

  /// The method's name in the .proto.
  static std::string_view Name(Method method);

  /// `metrics` and `context` outlive this object; this object outlives its calls.
  Methods(const ServerContext& context, Metrics& metrics);

  /// Begins a call of `method`: admits its caller, then reads from `channel`. If the caller is
  /// refused, ends the call instead. `channel` outlives the call.
  std::unique_ptr<ByteCall> Begin(Method method, CallChannel& channel,
                                  const CallOrigin& origin) const;

 private:
  ArrivedCall Arrive(Method method, CallChannel& channel, const CallOrigin& origin,
                     Permission permission) const;
  std::unique_ptr<ByteCall> ReconstructFrame(CallChannel& channel, const CallOrigin& origin) const;
  // Begins a call that returns information. A thread of the channel calls `answer` to create the
  // response.
  template <typename Request, typename Answer>
  std::unique_ptr<ByteCall> Information(Method method, CallChannel& channel,
                                        const CallOrigin& origin, Permission permission,
                                        Answer answer) const;
  absl::StatusOr<v1::ListStreamsResponse> ListStreams(const v1::ListStreamsRequest& request,
                                                      const Caller& caller) const;
  void AddRemoteStreams(const std::string& after, std::size_t page_size, const Caller& caller,
                        v1::ListStreamsResponse& response) const;
  v1::GetServerInfoResponse GetServerInfo() const;

  const ServerContext& context_;
  const CallMeters meters_;
};

}  // namespace partiemc::server
