// The messages of one stream and the session behind them, whatever transport they travel through.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/frame_parts.h"
#include "server/calls/resume.h"
#include "server/stream/limits.h"
#include "server/stream/session.h"
#include "server/stream/stream_registry.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/result_broadcaster.h"
#include "wire/codec.h"

namespace partiemc::server {

/// Beside the reasons of streams, of sessions, of the core and of the codec (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonOpenBytes = "OPEN_BYTES";

void EncodeLimits(const ServerLimits& limits, v1::Limits& message);

/// As wire::DecodeFrame. Errors: those of it; FRAME_BYTES for a frame that is larger than was
/// announced.
absl::StatusOr<Frame> DecodeFrameWithin(const v1::ParticleFrame& frame, const ServerLimits& limits,
                                        const wire::Outputs& outputs, wire::AttributeViews& views);

/// Has `session` answer `frame`, taken to have the given sequence number, and writes the result
/// into `message`. Errors: those of Session::Answer.
absl::Status AnswerFrame(const absl::StatusOr<Frame>& frame, std::uint64_t sequence,
                         const wire::Outputs& outputs, Session& session, Worker& worker,
                         const std::atomic<bool>& cancelled, v1::ReconstructedFrame& message);

/// Slots hold messages as bytes, and only from their reading or until their writing: what a frame
/// needs besides belongs to the worker that answers it, so that an idle stream holds next to
/// nothing. Not thread-safe as a whole: it relies on what StreamStateMachine promises.
class StreamMessages final : public StreamHandler {
 public:
  /// For the log.
  struct Origin {
    std::string peer, client;
  };

  /// One slot for each of limits.frames_in_flight.
  StreamMessages(const ServerLimits& limits, StreamRegistry& registry, WatchDispatcher& dispatcher,
                 const CurrentCheckpointKeys& checkpoint_keys, Origin origin);

  grpc::ByteBuffer& request(std::size_t slot) { return requests_[slot]; }
  RequestKind Kind(std::size_t slot);
  const grpc::ByteBuffer& response(Outgoing what, std::size_t slot);
  /// The response has been written: lets go of it.
  void Written(Outgoing what, std::size_t slot) { Response(what, slot).Clear(); }

  absl::Status Open(std::size_t slot, const StreamStateMachine& stream) override;
  Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) override;
  bool MayAnswer(std::size_t slot) override;
  std::chrono::milliseconds LookEvery() const override;
  const void* Assembly() const override;
  std::uint64_t ComputedBytes(std::size_t slot, std::uint64_t bytes) const override;
  bool DropFrame(std::size_t slot, const absl::Status& why) override;
  /// The call has ended: whoever waits for parts of it is told.
  void End(const absl::Status& status);

  /// Where the call sends a part of a stream that another one has opened.
  const std::optional<OtherPart>& other_part() const { return other_part_; }

 private:
  absl::Status OpenStream(const v1::OpenStream& open, const StreamStateMachine& stream);
  absl::Status JoinStream(const v1::OpenStream& open, const StreamStateMachine& stream);
  void TellOpened(v1::StreamOpened opened);
  absl::Status ParseWhole(std::size_t slot, v1::ReconstructRequest& request);
  Answered AnswerFrameIn(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled);
  Answered AnswerPart(std::size_t slot);
  std::function<void()> Afterwards(bool tell_watchers) const;
  grpc::ByteBuffer& Response(Outgoing what, std::size_t slot);
  // True if somebody watches and is to be told.
  bool ShowWatchers(std::size_t slot, const v1::ParticleFrame& request);

  const ServerLimits& limits_;
  StreamRegistry& registry_;
  const CurrentCheckpointKeys& checkpoint_keys_;
  const Origin origin_;
  const std::shared_ptr<ResultBroadcaster> broadcaster_;
  std::vector<grpc::ByteBuffer> requests_;
  std::vector<grpc::ByteBuffer> answers_;
  grpc::ByteBuffer opened_;
  grpc::ByteBuffer draining_;
  std::optional<Session> session_;  // Once open.
  // Of a stream whose frames come in parts, one of the two, once open.
  std::optional<PartZero> part_zero_;
  std::optional<OtherPart> other_part_;
  StreamTerms terms_;
  wire::Outputs outputs_;
};

}  // namespace partiemc::server
