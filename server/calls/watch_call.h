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
#include "server/relay/relay.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/watch/watch_registry.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

class WatchCall final : public ByteCall, private WatchTransport {
 public:
  /// What is passed outlives the call. Without a `relay` it finds streams of this server only.
  WatchCall(CallChannel& channel, const MethodMeters* meters,
            absl::StatusOr<AdmittedCall> admission, const ServerLimits& limits,
            OpeningCalls& opening, StreamRegistry& streams, WatchRegistry& watchers, Relay* relay);

  void OnCancel() override;
  void OnDone() override;

 private:
  void ReadDone(bool ok) override;
  void WriteDone(bool ok) override;
  void StartRead() override;
  void StartOpen() override;
  void WriteOpened(const HeldFrames& held) override;
  void WriteFrame(const Published& published, std::uint64_t dropped,
                  std::uint64_t oldest_sequence) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  absl::StatusOr<WatchTerms> ReadTerms() const;
  absl::Status OpenHere(const StreamSummary& stream);
  absl::Status OpenRemote(const Relay::Found& found);
  absl::Status TakePlace(const std::string& stream_id, const std::string& stream_name);
  void Write(grpc::ByteBuffer response);
  void LogEnd(const absl::Status& status) const;

  OpeningCalls& opening_calls_;
  StreamRegistry& streams_;
  WatchRegistry& watchers_;
  Relay* const relay_;
  grpc::ByteBuffer request_, response_;
  v1::WatchStreamRequest parsed_;
  v1::WatchStreamResponse opened_;  // Once open.
  WatchTerms terms_;
  std::string stream_name_;
  std::string end_reason_;
  std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
  std::shared_ptr<WatchStateMachine> machine_;
};

}  // namespace partiemc::server
