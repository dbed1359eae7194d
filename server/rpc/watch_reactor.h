// The gRPC transport of a watcher: translates between gRPC's callbacks and a WatchStateMachine.
// Frames pass as bytes that all watchers of a stream share.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/rpc/byte_call.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/watch/watch_registry.h"
#include "server/watch/watch_state_machine.h"
#include "wire/watched_bytes.h"

namespace partiemc::server {

/// A result as this transport hands it to watchers.
class WatchedResult final : public WatchFrame {
 public:
  explicit WatchedResult(wire::WatchedBytes result)
      : WatchFrame(result.size()), bytes(std::move(result)) {}

  const wire::WatchedBytes bytes;
};

class WatchReactor final : public ByteCall, private WatchTransport {
 public:
  /// What is passed by reference outlives the call.
  WatchReactor(grpc::CallbackServerContext& context, absl::StatusOr<AdmittedCall> admission,
               const ServerLimits& limits, OpeningCalls& opening, StreamRegistry& streams,
               WatchRegistry& watchers);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;

 private:
  void StartRead() override;
  absl::StatusOr<WatchTerms> Open() override;
  void WriteOpened() override;
  void WriteFrame(const WatchFrame& frame, std::uint64_t dropped) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;
  void Left() override;

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
