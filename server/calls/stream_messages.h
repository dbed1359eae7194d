// Reads and writes the messages of streams and frames. Several kinds of calls use these functions.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/compute/worker.h"
#include "server/stream/limits.h"
#include "server/stream/session.h"
#include "wire/codec.h"

namespace partiemc::server {

/// Reason of refusing an `open` that is too large (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonOpenBytes = "OPEN_BYTES";

void EncodeLimits(const ServerLimits& limits, v1::Limits& message);

/// Parses a request that contains an `open`, and clears its bytes. Errors: OPEN_BYTES, PROTOCOL.
absl::Status ParseOpen(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                       v1::ReconstructRequest& request);

/// Decodes a frame (wire::DecodeFrame) after checking its size. The result refers to `frame` and
/// `views`. Errors: the errors of wire::DecodeFrame; FRAME_BYTES for a frame above the limit.
absl::StatusOr<Frame> DecodeFrameWithin(const v1::ParticleFrame& frame, const ServerLimits& limits,
                                        const wire::Outputs& outputs, wire::AttributeViews& views);

/// Computes `frame` in `session` under the number `sequence`, and writes the result into `message`.
/// Errors: the errors of Session::Answer.
absl::Status AnswerFrame(const absl::StatusOr<Frame>& frame, std::uint64_t sequence,
                         const wire::Outputs& outputs, Session& session, Worker& worker,
                         const std::atomic<bool>& cancelled, v1::ReconstructedFrame& message);

/// Messages that a worker keeps from frame to frame, so that their buffers are reused.
struct FrameMessages final : MessageBuffers {
  v1::ReconstructRequest request;
  v1::ReconstructResponse result;   ///< Never an error, which would free its buffers.
  wire::AttributeViews attributes;  ///< Views into `request`.

  /// Takes the messages out of the worker, or creates them. So they remain if the session frees all
  /// buffers of the worker because memory is short.
  static std::unique_ptr<FrameMessages> Take(Worker& worker);
  /// Frees the buffers of `request` if they are far larger than the last request, which had
  /// `request_bytes`. Otherwise the buffers would add up if different fields are large in different
  /// requests.
  void Shrink(std::uint64_t request_bytes);
};

/// Creates the drain notice, which contains the addresses of other replicas.
grpc::ByteBuffer DrainNotice(const std::vector<std::string>& elsewhere);

}  // namespace partiemc::server
