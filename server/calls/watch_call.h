// The call of a watcher, over any channel. All watchers of a stream share the bytes of its results.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/byte_call.h"
#include "server/calls/server_context.h"
#include "server/relay/relay.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/watch/level_queue.h"
#include "server/watch/watch_registry.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

class WatchCall final : public ByteCall, private WatchTransport, private LevelQueue::Waiter {
 public:
  WatchCall(ArrivedCall call, const ServerContext& context);

  void OnCancel() override;
  void OnDone() override;

 private:
  void OnRequest() override;
  void OnRequestsEnded() override { machine_->ReadEnded(); }
  void OnResponseWritten(bool ok) override;

  void StartRead() override;
  void StartOpen() override;
  void WriteOpened(const HeldFrames& held) override;
  void WriteFrame(const Published& published, std::uint64_t dropped,
                  std::uint64_t oldest_sequence) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void LevelDone(const absl::StatusOr<LevelQueue::Frame>& level) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  absl::StatusOr<WatchTerms> ReadTerms() const;
  absl::Status JoinLevel(bool has_surfaces);
  absl::Status OpenHere(const StreamSummary& stream);
  absl::Status OpenRemote(const Relay::Found& found);
  absl::Status OpenFinished(const std::string& name, const absl::Status& not_found);
  absl::Status TakePlace(const std::string& stream_id, const std::string& stream_name);
  void Write(grpc::ByteBuffer response);
  void LogEnd(const absl::Status& status) const;

  grpc::ByteBuffer request_, response_;
  v1::WatchStreamRequest parsed_;
  v1::WatchStreamResponse opened_;  // Filled in when the stream is found.
  WatchTerms terms_;
  LevelQueue::Seat level_;  // Empty: the watcher receives exact results.
  // Sequence number of the last result of a finished stream; 0: it has none, or the stream is live.
  std::uint64_t finished_sequence_ = 0;
  std::uint64_t level_dropped_ = 0, level_oldest_ = 0;  // Arguments of WriteFrame until LevelDone.
  std::string stream_name_;
  std::string end_reason_;
  std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
  std::shared_ptr<WatchStateMachine> machine_;
};

}  // namespace partiemc::server
