#include "server/stream_messages.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

absl::StatusOr<Frame> DecodeFrameWithin(const v1::ParticleFrame& frame, std::uint64_t max_bytes) {
  if (const std::size_t bytes = frame.ByteSizeLong(); bytes > max_bytes) {
    return ViolationError(absl::StatusCode::kResourceExhausted,
                          {std::string(kReasonFrameBytes), "frame", absl::StrCat(bytes, " bytes"),
                           absl::StrCat("must be at most ", max_bytes, " bytes")});
  }
  return wire::DecodeFrame(frame);
}

// Parts of the protocol that this server does not speak are refused, not ignored.
absl::Status CheckCapabilities(const v1::OpenStream& open) {
  const auto unsupported = [](std::string field, std::string value) {
    return ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(wire::kReasonUnsupported), std::move(field), std::move(value),
         "must be absent: this server lacks the capability \"resume\""});
  };
  if (open.checkpoint_interval() != 0) {
    return unsupported("open.checkpoint_interval", absl::StrCat(open.checkpoint_interval()));
  }
  if (open.has_resume()) return unsupported("open.resume", "present");
  return absl::OkStatus();
}

}  // namespace

void EncodeLimits(const ServerLimits& limits, v1::Limits& message) {
  message.set_max_particles_per_frame(limits.frame.max_particles);
  message.set_max_frame_bytes(limits.max_frame_bytes);
  message.set_max_tiles_per_frame(limits.frame.max_tiles);
  message.set_max_streams(limits.max_streams);
}

absl::Status AnswerFrame(const v1::ParticleFrame& frame, std::uint64_t sequence,
                         const wire::Outputs& outputs, const ServerLimits& limits, Session& session,
                         Worker& worker, v1::ReconstructedFrame& message) {
  const auto deliver = [&](const Result& result, const StageClock& clock) {
    return wire::EncodeResult(result, {clock.stages_ms(), clock.TotalMs()}, outputs, message);
  };
  auto status =
      session.Answer(sequence, DecodeFrameWithin(frame, limits.max_frame_bytes), worker, deliver);
  if (status.ok()) message.set_time(frame.time());
  return status;
}

StreamMessages::StreamMessages(const ServerLimits& limits, StreamRegistry& registry)
    : limits_(limits),
      registry_(registry),
      requests_(limits.frames_in_flight),
      answers_(limits.frames_in_flight) {
  v1::StreamNotice& notice = *draining_.mutable_notice();
  notice.set_kind(v1::StreamNotice::KIND_DRAINING);
  notice.set_message("the server is going away: finish reading, then connect elsewhere");
}

RequestKind StreamMessages::Kind(std::size_t slot) const {
  switch (requests_[slot].request_case()) {
    case v1::ReconstructRequest::kOpen:
      return RequestKind::kOpen;
    case v1::ReconstructRequest::kFrame:
      return RequestKind::kFrame;
    case v1::ReconstructRequest::REQUEST_NOT_SET:
      break;
  }
  return RequestKind::kEmpty;
}

const v1::ReconstructResponse& StreamMessages::response(Outgoing what, std::size_t slot) const {
  switch (what) {
    case Outgoing::kOpened:
      return opened_;
    case Outgoing::kDraining:
      return draining_;
    case Outgoing::kAnswer:
      break;
  }
  return answers_[slot];
}

absl::StatusOr<StreamSummary> StreamMessages::Open(std::size_t slot, const StreamFlow& flow) {
  const v1::OpenStream& open = requests_[slot].open();
  if (auto status = CheckCapabilities(open); !status.ok()) return status;
  const auto parameters = wire::DecodeParameters(open.parameters());
  if (!parameters.ok()) return parameters.status();
  const auto outputs = wire::DecodeOutputs(open.outputs(), open.has_outputs());
  if (!outputs.ok()) return outputs.status();
  auto session = Session::Open(*parameters, limits_.frame);
  if (!session.ok()) return session.status();
  auto stream = registry_.Open(flow, {.name = open.stream_name(),
                                      .labels = {open.labels().begin(), open.labels().end()},
                                      .parameters = session->parameters()});
  if (!stream.ok()) return stream.status();
  session_ = *std::move(session);
  outputs_ = *outputs;

  v1::StreamOpened& opened = *opened_.mutable_opened();
  opened.set_stream_id(stream->id);
  wire::EncodeParameters(session_->parameters(), *opened.mutable_parameters());
  opened.set_frames_in_flight(limits_.frames_in_flight);
  EncodeLimits(limits_, *opened.mutable_limits());
  opened.set_next_sequence(session_->next_sequence());
  return stream;
}

Answered StreamMessages::Answer(std::size_t slot, Worker& worker) {
  const v1::ParticleFrame& frame = requests_[slot].frame();
  v1::ReconstructResponse& answer = answers_[slot];
  const auto status = AnswerFrame(frame, frame.sequence(), outputs_, limits_, *session_, worker,
                                  *answer.mutable_frame());
  if (status.ok()) {
    answer.mutable_frame()->set_sequence(frame.sequence());
  } else {
    wire::EncodeFrameError(status, frame.sequence(), session_->next_sequence(),
                           *answer.mutable_error());
  }
  // An idle stream does not sit on the memory of its last frames.
  requests_[slot].Clear();
  return {.is_result = status.ok(), .last_sequence = session_->next_sequence() - 1};
}

}  // namespace partiemc::server
