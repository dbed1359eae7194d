// A watcher: translates between its channel and a WatchStateMachine.
// Frames pass as bytes that all watchers of a stream share.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/byte_call.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/watch/watch_registry.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

class WatchCall final : public ByteCall, private WatchTransport {
 public:
  /// What is passed by reference outlives the call.
  WatchCall(CallChannel& channel, const MethodMeters* meters,
            absl::StatusOr<AdmittedCall> admission, const ServerLimits& limits,
            OpeningCalls& opening, StreamRegistry& streams, WatchRegistry& watchers);

  void OnCancel() override;
  void OnDone() override;

 private:
  void ReadDone(bool ok) override;
  void WriteDone(bool ok) override;
  void StartRead() override;
  absl::StatusOr<WatchTerms> Open() override;
  void WriteOpened(const HeldFrames& held) override;
  void WriteFrame(const WatchFrame& frame, std::uint64_t dropped,
                  std::uint64_t oldest_sequence) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  void Write(grpc::ByteBuffer response);
  void LogEnd(const absl::Status& status) const;

  OpeningCalls& opening_calls_;
  StreamRegistry& streams_;
  WatchRegistry& watchers_;
  grpc::ByteBuffer request_, response_;
  v1::WatchStreamRequest parsed_;
  v1::WatchStreamResponse opened_;  // Once open.
  std::string stream_name_;
  std::string end_reason_;
  std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
  std::shared_ptr<WatchStateMachine> machine_;
};

}  // namespace partiemc::server
