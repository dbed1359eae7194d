#include "server/calls/stream_messages.h"

#include <chrono>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/relay/watched_result.h"
#include "server/stream/stream_token.h"
#include "server/telemetry/logging.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

// Not worth giving up.
constexpr std::size_t kSmallBuffers = std::size_t{4} << 20;

// What a worker keeps warm of messages: a frame's arrays are views into `request`.
struct FrameMessages final : MessageBuffers {
  v1::ReconstructRequest request;
  v1::ReconstructResponse result;   // Never an error, whose coming would drop its buffers.
  wire::AttributeViews attributes;  // Into `request`.
};

// Taken from the worker for as long as they are used: a session that has run out of memory drops
// all that its worker holds. No other kind of transport has put anything else there.
std::unique_ptr<FrameMessages> TakeMessages(Worker& worker) {
  if (worker.message_buffers == nullptr) return std::make_unique<FrameMessages>();
  return std::unique_ptr<FrameMessages>(
      static_cast<FrameMessages*>(worker.message_buffers.release()));
}

absl::Status TooLargeOpen(std::size_t bytes, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOpenBytes), "open", absl::StrCat(bytes, " bytes"), std::move(rule)});
}

// Parses a request that holds an `open`, and gives its bytes up.
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

// Gives up buffers that have grown far beyond the request that they were last used for: fields that
// take turns at being large would add up.
void ShrinkBuffers(std::uint64_t bytes, v1::ReconstructRequest& request) {
  if (request.SpaceUsedLong() > 4 * bytes + kSmallBuffers) request = {};
}

grpc::ByteBuffer DrainNotice(const std::vector<std::string>& elsewhere) {
  v1::ReconstructResponse response;
  v1::StreamNotice& notice = *response.mutable_notice();
  notice.set_kind(v1::StreamNotice::KIND_DRAINING);
  notice.set_message("the server is going away: finish reading, then connect elsewhere");
  notice.mutable_addresses()->Assign(elsewhere.begin(), elsewhere.end());
  return wire::ToBytes(response);
}

}  // namespace

void EncodeLimits(const ServerLimits& limits, v1::Limits& message) {
  message.set_max_particles_per_frame(limits.frame.max_particles);
  message.set_max_frame_bytes(limits.max_frame_bytes);
  message.set_max_tiles_per_frame(limits.frame.max_tiles);
  message.set_max_streams(limits.max_streams);
  // Rounded up: 0 would mean none.
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

StreamMessages::StreamMessages(const ServerLimits& limits, StreamRegistry& registry,
                               WatchDispatcher& dispatcher,
                               const CurrentCheckpointKeys& checkpoint_keys, Origin origin)
    : limits_(limits),
      registry_(registry),
      checkpoint_keys_(checkpoint_keys),
      origin_(std::move(origin)),
      broadcaster_(std::make_shared<ResultBroadcaster>(
          dispatcher, ResultBroadcaster::Limits{.mailbox_bytes = limits.max_watcher_bytes,
                                                .kept_bytes = limits.KeptResultBytes()})),
      requests_(limits.frames_in_flight),
      answers_(limits.frames_in_flight) {}

RequestKind StreamMessages::Kind(std::size_t slot) {
  using v1::ReconstructRequest;
  switch (wire::HeldField(requests_[slot], ReconstructRequest::kFrameFieldNumber).value_or(-1)) {
    case ReconstructRequest::kOpenFieldNumber:
      return RequestKind::kOpen;
    case ReconstructRequest::kFrameFieldNumber:
      if (part_zero_) part_zero_->Came(slot, requests_[slot]);
      if (other_part_) other_part_->Came(slot, requests_[slot]);
      return RequestKind::kFrame;
    case 0:
      return RequestKind::kEmpty;
    default:
      return RequestKind::kMalformed;
  }
}

const grpc::ByteBuffer& StreamMessages::response(Outgoing what, std::size_t slot) {
  if (what == Outgoing::kDraining) draining_ = DrainNotice(registry_.TakeElsewhere());
  return Response(what, slot);
}

grpc::ByteBuffer& StreamMessages::Response(Outgoing what, std::size_t slot) {
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

absl::Status StreamMessages::Open(std::size_t slot, const StreamStateMachine& stream_machine) {
  v1::ReconstructRequest request;
  if (auto status = ParseOpen(requests_[slot], limits_.MaxOpenBytes(), request); !status.ok()) {
    return status;
  }
  const v1::OpenStream& open = request.open();
  if (auto status = CheckParts(open, limits_); !status.ok()) return status;
  return open.part() > 0 ? JoinStream(open, stream_machine) : OpenStream(open, stream_machine);
}

absl::Status StreamMessages::OpenStream(const v1::OpenStream& open,
                                        const StreamStateMachine& stream_machine) {
  const auto parameters = wire::DecodeParameters(open.parameters());
  if (!parameters.ok()) return parameters.status();
  const auto outputs = wire::DecodeOutputs(open.outputs(), open.has_outputs());
  if (!outputs.ok()) return outputs.status();
  if (parameters->slice && outputs->echo_particles) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {std::string(wire::kReasonUnsupported), "outputs.echo_particles", "true",
                           "must be false with a slice, whose particles are not in its plane"});
  }
  auto session = Session::Open(*parameters, limits_.frame);
  if (!session.ok()) return session.status();
  const std::string token = open.has_resume() ? open.resume().stream_token() : NewStreamToken();
  StreamTerms terms = TermsOf(open, *outputs, token);
  if (open.has_resume()) {
    auto status = Resume(open.resume(), limits_, checkpoint_keys_, *session, terms);
    if (!status.ok()) return status;
  }
  // Before others can join.
  if (open.parts() > 0) part_zero_.emplace(open, limits_, session->next_sequence());
  auto stream = registry_.Open(stream_machine,
                               {.name = terms.name,
                                .labels = {open.labels().begin(), open.labels().end()},
                                .parameters = session->parameters(),
                                .broadcaster = broadcaster_,
                                .next_sequence = session->next_sequence(),
                                .assembler = part_zero_ ? part_zero_->assembler() : nullptr,
                                .parts_token = open.parts_token()},
                               token);
  if (!stream.ok()) return stream.status();
  session_ = *std::move(session);
  outputs_ = *outputs;
  terms_ = std::move(terms);
  terms_.name = stream->description.name;

  v1::StreamOpened opened;
  opened.set_stream_id(stream->id);
  opened.set_stream_token(token);
  wire::EncodeParameters(session_->parameters(), *opened.mutable_parameters());
  opened.set_next_sequence(session_->next_sequence());
  TellOpened(std::move(opened));
  LogEvent(spdlog::level::info, "stream opened",
           {{"id", stream->id},
            {"name", terms_.name},
            {"peer", origin_.peer},
            {"client", origin_.client},
            {"placement", std::string(Name(session_->parameters().placement))},
            {"fill", std::string(Name(session_->parameters().fill))},
            {"parts", std::uint64_t{open.parts()}}});
  return absl::OkStatus();
}

absl::Status StreamMessages::JoinStream(const v1::OpenStream& open,
                                        const StreamStateMachine& stream_machine) {
  auto joined = registry_.JoinPart(stream_machine, {.stream_name = open.stream_name(),
                                                    .part = open.part(),
                                                    .parts = open.parts(),
                                                    .token = open.parts_token()});
  if (!joined.ok()) return joined.status();
  other_part_.emplace(*std::move(joined), limits_.frames_in_flight);
  const JoinedPart& part = other_part_->joined();
  v1::StreamOpened opened;
  opened.set_stream_id(part.stream_id);
  wire::EncodeParameters(part.parameters, *opened.mutable_parameters());
  opened.set_next_sequence(part.assembler->next_wanted());
  TellOpened(std::move(opened));
  LogEvent(spdlog::level::info, "part joined",
           {{"stream", part.stream_id},
            {"name", open.stream_name()},
            {"part", std::uint64_t{part.seat.part}},
            {"peer", origin_.peer},
            {"client", origin_.client}});
  return absl::OkStatus();
}

void StreamMessages::TellOpened(v1::StreamOpened opened) {
  opened.set_frames_in_flight(limits_.frames_in_flight);
  EncodeLimits(limits_, *opened.mutable_limits());
  v1::ReconstructResponse response;
  *response.mutable_opened() = std::move(opened);
  opened_ = wire::ToBytes(response);
}

bool StreamMessages::MayAnswer(std::size_t slot) {
  if (part_zero_) return part_zero_->MayAnswer(slot);
  return !other_part_ || other_part_->MayAnswer(slot);
}

std::chrono::milliseconds StreamMessages::LookEvery() const {
  if (part_zero_) return part_zero_->LookEvery();
  return other_part_ ? other_part_->LookEvery() : std::chrono::milliseconds(0);
}

std::uint64_t StreamMessages::ComputedBytes(std::size_t /*slot*/, std::uint64_t bytes) const {
  if (other_part_) return 0;
  return part_zero_ ? bytes + part_zero_->assembler()->BytesOfNext() : bytes;
}

// Whole frames are computed in their turn. A part may wait for others for long.
bool StreamMessages::DropFrame(std::size_t slot, const absl::Status& why) {
  if (!other_part_) return false;
  other_part_->Refuse(slot, why);
  requests_[slot].Clear();
  return true;
}

const void* StreamMessages::Assembly() const {
  if (part_zero_) return part_zero_->assembler().get();
  return other_part_ ? other_part_->joined().assembler.get() : nullptr;
}

void StreamMessages::End(const absl::Status& status) {
  if (part_zero_) part_zero_->assembler()->End(status);
  if (other_part_) other_part_->joined().assembler->Leave(other_part_->joined().seat);
}

Answered StreamMessages::Answer(std::size_t slot, Worker& worker,
                                const std::atomic<bool>& cancelled) {
  return other_part_ ? AnswerPart(slot) : AnswerFrameIn(slot, worker, cancelled);
}

Answered StreamMessages::AnswerPart(std::size_t slot) {
  absl::Status refusal;
  answers_[slot] = wire::ToBytes(other_part_->Answer(slot, refusal));
  requests_[slot].Clear();
  return {.is_result = refusal.ok(), .bytes = answers_[slot].Length()};
}

// The frame in `slot`, with its other parts where it has any.
absl::Status StreamMessages::ParseWhole(std::size_t slot, v1::ReconstructRequest& request) {
  auto status = ParseFrame(requests_[slot], request);
  if (status.ok() && part_zero_) {
    status = part_zero_->Join(slot, outputs_.attributes, request);
    if (status.ok() && outputs_.echo_particles) requests_[slot] = wire::ToBytes(request);
  }
  if (!outputs_.echo_particles) requests_[slot].Clear();
  return status;
}

Answered StreamMessages::AnswerFrameIn(std::size_t slot, Worker& worker,
                                       const std::atomic<bool>& cancelled) {
  std::unique_ptr<FrameMessages> messages = TakeMessages(worker);
  Answered answered;
  const std::uint64_t request_bytes = requests_[slot].Length();
  const absl::Status parsed = ParseWhole(slot, messages->request);
  const v1::ParticleFrame& request = messages->request.frame();
  v1::ReconstructedFrame& result = *messages->result.mutable_frame();
  const std::uint64_t next_sequence = session_->next_sequence();
  // Frames are numbered from 1: without a number, a malformed frame is neither a gap nor a
  // duplicate.
  const bool has_number = parsed.ok() || request.sequence() != 0;
  const absl::Status status =
      has_number
          ? AnswerFrame(parsed.ok()
                            ? DecodeFrameWithin(request, limits_, outputs_, messages->attributes)
                            : parsed,
                        request.sequence(), outputs_, *session_, worker, cancelled, result)
          : session_->Refuse(parsed, worker);
  std::string checkpoint =
      CheckpointAfter(next_sequence, *session_, terms_, limits_, checkpoint_keys_);
  if (part_zero_) {
    part_zero_->assembler()->Answered(session_->next_sequence(), !checkpoint.empty());
  }
  bool tell_watchers = false;
  if (status.ok()) {
    result.set_sequence(request.sequence());
    messages->result.set_checkpoint(std::move(checkpoint));
    answers_[slot] = wire::ToBytes(messages->result);
    tell_watchers = ShowWatchers(slot, request);
  } else {
    v1::ReconstructResponse error;
    wire::EncodeFrameError(status, request.sequence(), session_->next_sequence(),
                           *error.mutable_error());
    error.set_checkpoint(std::move(checkpoint));
    answers_[slot] = wire::ToBytes(error);
    messages->request.Clear();  // Nothing has checked its size.
  }
  ShrinkBuffers(request_bytes, messages->request);
  requests_[slot].Clear();
  worker.message_buffers = std::move(messages);
  answered.is_result = status.ok();
  answered.last_sequence = session_->next_sequence() - 1;
  answered.bytes = answers_[slot].Length();
  answered.afterwards = Afterwards(tell_watchers);
  return answered;
}

std::function<void()> StreamMessages::Afterwards(bool tell_watchers) const {
  const auto assembler = part_zero_ ? part_zero_->assembler() : nullptr;
  if (assembler == nullptr && !tell_watchers) return {};
  return [assembler, broadcaster = tell_watchers ? broadcaster_ : nullptr] {
    if (assembler != nullptr) assembler->TellMembers();
    if (broadcaster != nullptr) broadcaster->Announce();
  };
}

// They share the bytes of the answer, and of the request where particles are echoed.
bool StreamMessages::ShowWatchers(std::size_t slot, const v1::ParticleFrame& request) {
  wire::WatchedBytes bytes(answers_[slot]);
  if (outputs_.echo_particles) bytes.EchoParticles(requests_[slot], request);
  return broadcaster_->Publish(std::make_shared<WatchedResult>(std::move(bytes)),
                               request.sequence());
}

}  // namespace partiemc::server
