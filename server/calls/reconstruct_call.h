// The call of a producer, over any channel: interprets the messages of its stream and owns the
// session.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/byte_call.h"
#include "server/calls/frame_parts.h"
#include "server/calls/resume.h"
#include "server/calls/server_context.h"
#include "server/calls/stream_messages.h"
#include "server/stream/session.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/result_broadcaster.h"
#include "wire/codec.h"

namespace partiemc::server {

/// Keeps requests and responses as bytes, one of each per slot. A worker parses a frame only when
/// it computes the frame, into the worker's own buffers. So an idle stream holds little more than
/// its state. The thread rules of StreamTransport and StreamHandler apply.
class ReconstructCall final : public ByteCall, public StreamHandler, private StreamTransport {
 public:
  ReconstructCall(ArrivedCall call, const ServerContext& context);

  void OnCancel() override { machine_->Cancelled(); }
  void OnDone() override;

  // The steps of a frame. Public for the fuzz target, which replaces channel and state machine.

  grpc::ByteBuffer& Request(std::size_t slot) { return requests_[slot]; }
  grpc::ByteBuffer& Response(Outgoing what, std::size_t slot);
  /// Examines the request that was read into `slot` and returns its kind.
  RequestKind OnRequestRead(std::size_t slot);
  absl::Status Open(std::size_t slot, const StreamStateMachine& stream) override;
  Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) override;
  const StreamStateMachine& machine() const { return *machine_; }

 private:
  void OnRequest() override;
  void OnRequestsEnded() override { machine_->ReadEnded(); }
  void OnResponseWritten(bool ok) override;

  void StartRead(std::size_t slot) override;
  void StartWrite(Outgoing what, std::size_t slot) override;
  void Cut() override { channel().Cancel(); }
  void Finish(const absl::Status& status) override;
  std::string peer() const override { return channel().peer(); }

  bool MayAnswer(std::size_t slot) override { return frames_->MayAnswer(slot); }
  std::chrono::milliseconds LookEvery() const override { return frames_->LookEvery(); }
  std::uint64_t ComputedBytes(std::size_t slot, std::uint64_t bytes) const override;
  bool DropFrame(std::size_t slot, const absl::Status& why) override;
  const void* Assembly() const override { return frames_->assembler().get(); }

  void EndWatches(const StreamSummary& stream, const absl::Status& status);
  absl::Status OpenStream(const v1::OpenStream& open);
  absl::Status JoinStream(const v1::OpenStream& open);
  void PrepareOpened(v1::StreamOpened opened);
  Answered AnswerWhole(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled);
  absl::Status ParseWhole(std::size_t slot, v1::ReconstructRequest& request);
  absl::Status Compute(const absl::Status& parsed, FrameMessages& messages, Worker& worker,
                       const std::atomic<bool>& cancelled);
  bool Publish(std::size_t slot, const v1::ParticleFrame& request);
  std::function<void()> Afterwards(bool has_watchers) const;

  const std::shared_ptr<ResultBroadcaster> broadcaster_;
  std::vector<grpc::ByteBuffer> requests_;
  std::vector<grpc::ByteBuffer> answers_;
  grpc::ByteBuffer opened_, draining_;
  // The read and the write in progress.
  std::size_t read_slot_ = 0, written_slot_ = 0;
  Outgoing written_ = Outgoing::kAnswer;
  // Set by Open:
  std::unique_ptr<FrameArrival> frames_ = std::make_unique<FrameArrival>();
  std::optional<Session> session_;
  StreamTerms terms_;
  wire::Outputs outputs_;

  std::shared_ptr<StreamStateMachine> machine_;
};

}  // namespace partiemc::server
