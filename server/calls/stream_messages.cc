#include "server/calls/stream_messages.h"

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/stream/stream_state_machine.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

// Smaller buffers are always kept.
constexpr std::size_t kSmallBuffers = std::size_t{4} << 20;

absl::Status TooLargeOpen(std::size_t bytes, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOpenBytes), "open", absl::StrCat(bytes, " bytes"), std::move(rule)});
}

}  // namespace

absl::Status ParseOpen(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                       v1::ReconstructRequest& request) {
  const std::size_t size = bytes.Length();
  if (size > max_bytes) {
    return TooLargeOpen(size, absl::StrCat("must be at most ", max_bytes, " bytes"));
  }
  const bool parsed =
      wire::HasFewFields(bytes, *request.GetDescriptor()) && wire::MergeBytes(bytes, request);
  bytes.Clear();
  if (!parsed) {
    return ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(kReasonProtocol), "request", "malformed",
         absl::StrCat("must be a ReconstructRequest of at most ", wire::kMaxFields, " fields")});
  }
  if (size > kQuickOpenBytes + request.open().resume().checkpoint().size()) {
    return TooLargeOpen(
        size, absl::StrCat("must be at most ", kQuickOpenBytes, " bytes beside its checkpoint"));
  }
  return absl::OkStatus();
}

void EncodeLimits(const ServerLimits& limits, v1::Limits& message) {
  message.set_max_particles_per_frame(limits.frame.max_particles);
  message.set_max_frame_bytes(limits.max_frame_bytes);
  message.set_max_tiles_per_frame(limits.frame.max_tiles);
  message.set_max_streams(limits.max_streams);
  // Rounds up, because 0 would mean no limit.
  message.set_idle_timeout_seconds(static_cast<std::uint32_t>(
      std::chrono::ceil<std::chrono::seconds>(limits.idle.streaming).count()));
  message.set_max_watchers(limits.max_watchers);
  message.set_max_parts(limits.max_parts);
}

absl::StatusOr<Frame> DecodeFrameWithin(const v1::ParticleFrame& frame, const ServerLimits& limits,
                                        const wire::Outputs& outputs, wire::AttributeViews& views) {
  if (const std::size_t bytes = frame.ByteSizeLong(); bytes > limits.max_frame_bytes) {
    return ViolationError(absl::StatusCode::kResourceExhausted,
                          {std::string(kReasonFrameBytes), "frame", absl::StrCat(bytes, " bytes"),
                           absl::StrCat("must be at most ", limits.max_frame_bytes, " bytes")});
  }
  return wire::DecodeFrame(frame, outputs.attributes, views);
}

absl::Status AnswerFrame(const absl::StatusOr<Frame>& frame, std::uint64_t sequence,
                         const wire::Outputs& outputs, Session& session, Worker& worker,
                         const std::atomic<bool>& cancelled, v1::ReconstructedFrame& message) {
  const auto deliver = [&](const Result& result, const StageClock& clock) {
    return wire::EncodeResult(result, {clock.stages_ms(), clock.TotalMs()}, outputs, message);
  };
  auto status = session.Answer(sequence, frame, worker, deliver, &cancelled);
  if (status.ok()) message.set_time(frame->time);
  return status;
}

std::unique_ptr<FrameMessages> FrameMessages::Take(Worker& worker) {
  if (worker.message_buffers == nullptr) return std::make_unique<FrameMessages>();
  return std::unique_ptr<FrameMessages>(
      static_cast<FrameMessages*>(worker.message_buffers.release()));
}

void FrameMessages::Shrink(std::uint64_t request_bytes) {
  if (request.SpaceUsedLong() > 4 * request_bytes + kSmallBuffers) request = {};
}

grpc::ByteBuffer DrainNotice(const std::vector<std::string>& elsewhere) {
  v1::ReconstructResponse response;
  v1::StreamNotice& notice = *response.mutable_notice();
  notice.set_kind(v1::StreamNotice::KIND_DRAINING);
  notice.set_message("the server is going away: finish reading, then connect elsewhere");
  notice.mutable_addresses()->Assign(elsewhere.begin(), elsewhere.end());
  return wire::ToBytes(response);
}

}  // namespace partiemc::server
