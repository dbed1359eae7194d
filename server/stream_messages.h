// The messages of one stream and the session behind them, whatever door they travel through.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/limits.h"
#include "server/session.h"
#include "server/stream_flow.h"
#include "server/stream_registry.h"
#include "wire/codec.h"

namespace partiemc::server {

/// Beside the reasons of sessions, of the core and of the codec (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonFrameBytes = "FRAME_BYTES";

void EncodeLimits(const ServerLimits& limits, v1::Limits& message);

/// Has `session` answer `frame`, taken to have the given sequence number, and writes the result
/// into `message`. Errors: those of Session::Answer; also FRAME_BYTES, for a frame that is larger
/// than was announced, which uses up its sequence number.
absl::Status AnswerFrame(const v1::ParticleFrame& frame, std::uint64_t sequence,
                         const wire::Outputs& outputs, const ServerLimits& limits, Session& session,
                         Worker& worker, v1::ReconstructedFrame& message);

/// Not thread-safe as a whole: StreamFlow's promises to a StreamDoor are what it relies on.
class StreamMessages {
 public:
  /// One slot for each of limits.frames_in_flight.
  StreamMessages(const ServerLimits& limits, StreamRegistry& registry);

  v1::ReconstructRequest& request(std::size_t slot) { return requests_[slot]; }
  RequestKind Kind(std::size_t slot) const;
  const v1::ReconstructResponse& response(Outgoing what, std::size_t slot) const;

  /// As StreamDoor::Open and StreamDoor::Answer; gives the stream as it was opened.
  absl::StatusOr<StreamSummary> Open(std::size_t slot, const StreamFlow& flow);
  Answered Answer(std::size_t slot, Worker& worker);

 private:
  const ServerLimits& limits_;
  StreamRegistry& registry_;
  std::vector<v1::ReconstructRequest> requests_;
  std::vector<v1::ReconstructResponse> answers_;
  v1::ReconstructResponse opened_;
  v1::ReconstructResponse draining_;
  std::optional<Session> session_;  // Once open.
  wire::Outputs outputs_;
};

}  // namespace partiemc::server
