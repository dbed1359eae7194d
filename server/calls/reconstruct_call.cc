#include "server/calls/reconstruct_call.h"

#include <algorithm>
#include <utility>

#include "partiemc/status.h"
#include "server/compute/memory_budget.h"
#include "server/relay/finished_streams.h"
#include "server/relay/stream_summary.h"
#include "server/relay/watched_result.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/stream/stream_token.h"
#include "server/telemetry/logging.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

// A surface takes about this multiple of the memory that an outline takes for a message of the same
// size: a ball of 102,000 particles takes 37 MiB. The worker reserves the memory before the frame
// begins (WorkerMemory::BeginFrame), because a frame that has begun cannot wait for memory.
constexpr std::uint64_t kSurfaceFactor = 4;

void LogEnd(const std::optional<StreamSummary>& stream, const std::string& peer,
            const std::string& client, const absl::Status& status) {
  if (!stream) {
    LogRefusal("stream refused", peer, status, client);
    return;
  }
  const auto violation = FindViolation(status);
  const std::chrono::duration<double> open = std::chrono::steady_clock::now() - stream->opened;
  LogCall("stream closed", {{"id", stream->id},
                            {"name", stream->description.name},
                            {"frames", stream->counts.frames},
                            {"frame_errors", stream->counts.frame_errors},
                            {"watch_waits", stream->description.broadcaster->producer_waits()},
                            {"seconds", open.count()},
                            {"status", absl::StatusCodeToString(status.code())},
                            {"reason", violation ? violation->reason : std::string()}});
}

void LogPartEnd(const JoinedPart& part, const absl::Status& status) {
  const auto violation = FindViolation(status);
  LogCall("part left", {{"stream", part.stream_id},
                        {"part", std::uint64_t{part.seat.part}},
                        {"status", absl::StatusCodeToString(status.code())},
                        {"reason", violation ? violation->reason : std::string()}});
}

}  // namespace

ReconstructCall::ReconstructCall(ArrivedCall call, const ServerContext& context)
    : ByteCall(std::move(call), context),
      broadcaster_(std::make_shared<ResultBroadcaster>(
          context.dispatcher,
          ResultBroadcaster::Limits{.mailbox_bytes = context.limits.max_watcher_bytes,
                                    .kept_bytes = context.limits.KeptResultBytes()})),
      requests_(context.limits.frames_in_flight),
      answers_(context.limits.frames_in_flight),
      machine_(std::make_shared<StreamStateMachine>(
          static_cast<StreamTransport&>(*this), static_cast<StreamHandler&>(*this), context.pool,
          context.budget, context.limits.frames_in_flight, caller().account())) {
  absl::Status status = admission();
  if (status.ok()) status = context.streams.Enter(machine_, caller());
  if (status.ok()) AllowEviction(machine_);
  machine_->Start(std::move(status));
}

void ReconstructCall::OnRequest() {
  const RequestKind kind = OnRequestRead(read_slot_);
  machine_->ReadDone(kind, requests_[read_slot_].Length());
}

void ReconstructCall::OnResponseWritten(bool ok) {
  Response(written_, written_slot_).Clear();
  machine_->WriteDone(ok);
}

void ReconstructCall::OnDone() { context().streams.Leave(*machine_); }

void ReconstructCall::StartRead(std::size_t slot) {
  read_slot_ = slot;
  channel().StartRead(&requests_[slot]);
}

void ReconstructCall::StartWrite(Outgoing what, std::size_t slot) {
  written_ = what;
  written_slot_ = slot;
  if (what == Outgoing::kDraining) draining_ = DrainNotice(context().streams.TakeElsewhere());
  channel().StartWrite(&Response(what, slot));
}

void ReconstructCall::Finish(const absl::Status& status) {
  // Closes the stream before it sends the status, because a client that receives the status may
  // open a stream with the same name at once.
  const auto stream = context().streams.Close(*machine_);
  frames_->End(status);
  if (const JoinedPart* const part = frames_->joined()) {
    LogPartEnd(*part, status);
  } else {
    LogEnd(stream, channel().peer(), client(), status);
  }
  if (stream) EndWatches(*stream, status);
  End(status);
}

void ReconstructCall::EndWatches(const StreamSummary& stream, const absl::Status& status) {
  ResultBroadcaster& broadcaster = *stream.description.broadcaster;
  if (status.ok()) {
    relay::v1::LiveStream finished;
    EncodeSummary(stream, std::chrono::steady_clock::now(), *finished.mutable_summary());
    finished.set_lineage(stream.lineage);
    // The results of a stream that was resumed may all be at the former server.
    context().finished.Add(std::move(finished), std::max(broadcaster.last_sequence(),
                                                         stream.description.next_sequence - 1));
  } else {
    context().finished.Forget(stream.lineage);
  }
  broadcaster.End(WatchEnd::OfStream(status));
}

RequestKind ReconstructCall::OnRequestRead(std::size_t slot) {
  using v1::ReconstructRequest;
  switch (wire::HeldField(requests_[slot], ReconstructRequest::kFrameFieldNumber).value_or(-1)) {
    case ReconstructRequest::kOpenFieldNumber:
      return RequestKind::kOpen;
    case ReconstructRequest::kFrameFieldNumber:
      if (frames_->joined() != nullptr) machine_->PartArrives();
      frames_->OnFrame(slot, requests_[slot]);
      return RequestKind::kFrame;
    case 0:
      return RequestKind::kEmpty;
    default:
      return RequestKind::kMalformed;
  }
}

grpc::ByteBuffer& ReconstructCall::Response(Outgoing what, std::size_t slot) {
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

absl::Status ReconstructCall::Open(std::size_t slot, const StreamStateMachine& /*stream*/) {
  v1::ReconstructRequest request;
  const std::uint64_t max_bytes = context().limits.MaxOpenBytes();
  if (auto status = ParseOpen(requests_[slot], max_bytes, request); !status.ok()) return status;
  const v1::OpenStream& open = request.open();
  if (auto status = CheckParts(open, context().limits); !status.ok()) return status;
  return open.part() > 0 ? JoinStream(open) : OpenStream(open);
}

absl::Status ReconstructCall::OpenStream(const v1::OpenStream& open) {
  const auto parameters = wire::DecodeParameters(open.parameters());
  if (!parameters.ok()) return parameters.status();
  const auto outputs = wire::DecodeOutputs(open.outputs(), open.has_outputs());
  if (!outputs.ok()) return outputs.status();
  if (parameters->slice && outputs->echo_particles) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {std::string(wire::kReasonUnsupported), "outputs.echo_particles", "true",
                           "must be false with a slice, whose particles are not in its plane"});
  }
  auto session =
      Session::Open(*parameters, context().limits.frame, {context().states, caller().account()});
  if (!session.ok()) return session.status();
  const std::string token = open.has_resume() ? open.resume().stream_token() : NewStreamToken();
  StreamTerms terms = TermsOf(open, *outputs, token);
  if (open.has_resume()) {
    auto status = Resume(open.resume(), context(), *session, terms);
    if (!status.ok()) return status;
  }
  // Before streams.Open, after which other parts can join.
  if (open.parts() > 0) {
    frames_ = std::make_unique<PartZero>(open, context().limits, session->next_sequence());
  }
  auto stream = context().streams.Open(*machine_,
                                       {.name = terms.name,
                                        .labels = {open.labels().begin(), open.labels().end()},
                                        .parameters = session->parameters(),
                                        .broadcaster = broadcaster_,
                                        .next_sequence = session->next_sequence(),
                                        .assembler = frames_->assembler(),
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
  PrepareOpened(std::move(opened));
  LogCall("stream opened", {{"id", stream->id},
                            {"name", terms_.name},
                            {"peer", channel().peer()},
                            {"client", caller().name()},
                            {"output", std::string(Name(session_->parameters().output))},
                            {"placement", std::string(Name(session_->parameters().placement))},
                            {"fill", std::string(Name(session_->parameters().fill))},
                            {"parts", std::uint64_t{open.parts()}}});
  return absl::OkStatus();
}

absl::Status ReconstructCall::JoinStream(const v1::OpenStream& open) {
  auto joined = context().streams.JoinPart(*machine_, {.stream_name = open.stream_name(),
                                                       .part = open.part(),
                                                       .parts = open.parts(),
                                                       .token = open.parts_token()});
  if (!joined.ok()) return joined.status();
  frames_ = std::make_unique<OtherPart>(*std::move(joined), context().limits.frames_in_flight);
  const JoinedPart& part = *frames_->joined();
  v1::StreamOpened opened;
  opened.set_stream_id(part.stream_id);
  wire::EncodeParameters(part.parameters, *opened.mutable_parameters());
  opened.set_next_sequence(part.assembler->next_wanted());
  PrepareOpened(std::move(opened));
  LogCall("part joined", {{"stream", part.stream_id},
                          {"name", open.stream_name()},
                          {"part", std::uint64_t{part.seat.part}},
                          {"peer", channel().peer()},
                          {"client", caller().name()}});
  return absl::OkStatus();
}

void ReconstructCall::PrepareOpened(v1::StreamOpened opened) {
  opened.set_frames_in_flight(context().limits.frames_in_flight);
  EncodeLimits(context().limits, *opened.mutable_limits());
  opened.set_frame_boxes(true);
  v1::ReconstructResponse response;
  *response.mutable_opened() = std::move(opened);
  opened_ = wire::ToBytes(response);
}

std::uint64_t ReconstructCall::ComputedBytes(std::size_t /*slot*/, std::uint64_t bytes) const {
  const bool is_surface = session_ && session_->parameters().output == Output::kSurface;
  return (is_surface ? kSurfaceFactor : 1) * frames_->ComputedBytes(bytes);
}

bool ReconstructCall::DropFrame(std::size_t slot, const absl::Status& why) {
  const bool dropped = frames_->DropFrame(slot, why);
  if (dropped) requests_[slot].Clear();
  return dropped;
}

Answered ReconstructCall::Answer(std::size_t slot, Worker& worker,
                                 const std::atomic<bool>& cancelled) {
  Answered answered;
  if (const auto response = frames_->RespondToPart(slot)) {
    answers_[slot] = wire::ToBytes(*response);
    answered.is_result = response->has_part();
  } else {
    answered = AnswerWhole(slot, worker, cancelled);
  }
  requests_[slot].Clear();
  answered.bytes = answers_[slot].Length();
  return answered;
}

Answered ReconstructCall::AnswerWhole(std::size_t slot, Worker& worker,
                                      const std::atomic<bool>& cancelled) {
  std::unique_ptr<FrameMessages> messages = FrameMessages::Take(worker);
  const std::uint64_t request_bytes = requests_[slot].Length();
  const std::uint64_t sequence = session_->next_sequence();
  const absl::Status parsed = ParseWhole(slot, messages->request);
  const absl::Status status = Compute(parsed, *messages, worker, cancelled);
  const v1::ParticleFrame& request = messages->request.frame();
  std::string checkpoint = CheckpointAfter(sequence, *session_, terms_, context());
  frames_->OnAnswered(session_->next_sequence(), !checkpoint.empty());
  bool has_watchers = false;
  if (status.ok()) {
    messages->result.set_checkpoint(std::move(checkpoint));
    answers_[slot] = wire::ToBytes(messages->result);
    has_watchers = Publish(slot, request);
  } else {
    v1::ReconstructResponse error;
    wire::EncodeFrameError(status, request.sequence(), session_->next_sequence(),
                           *error.mutable_error());
    error.set_checkpoint(std::move(checkpoint));
    answers_[slot] = wire::ToBytes(error);
    messages->request.Clear();  // It may exceed the limit of a frame.
  }
  messages->Shrink(request_bytes);
  worker.message_buffers = std::move(messages);
  return {.is_result = status.ok(),
          .is_cancelled = absl::IsCancelled(status),
          .last_sequence = session_->next_sequence() - 1,
          .afterwards = Afterwards(has_watchers)};
}

// Parses a frame and completes it from its parts. Keeps the bytes of the request only if the client
// has requested an echo.
absl::Status ReconstructCall::ParseWhole(std::size_t slot, v1::ReconstructRequest& request) {
  auto status = ParseFrame(requests_[slot], request);
  if (status.ok()) status = frames_->Complete(slot, outputs_, request, requests_[slot]);
  if (!outputs_.echo_particles) requests_[slot].Clear();
  return status;
}

// Computes a frame. Sequence numbers begin with 1. If the number of a malformed frame is 0, it
// could not be read, so the frame is neither a gap nor a duplicate.
absl::Status ReconstructCall::Compute(const absl::Status& parsed, FrameMessages& messages,
                                      Worker& worker, const std::atomic<bool>& cancelled) {
  const v1::ParticleFrame& frame = messages.request.frame();
  if (!parsed.ok() && frame.sequence() == 0) return session_->Refuse(parsed, worker);
  v1::ReconstructedFrame& result = *messages.result.mutable_frame();
  auto status = AnswerFrame(
      parsed.ok() ? DecodeFrameWithin(frame, context().limits, outputs_, messages.attributes)
                  : parsed,
      frame.sequence(), outputs_, *session_, worker, cancelled, result);
  if (status.ok()) result.set_sequence(frame.sequence());
  return status;
}

// Publishes the response to watchers, who share its bytes. Returns whether there are watchers.
bool ReconstructCall::Publish(std::size_t slot, const v1::ParticleFrame& request) {
  wire::WatchedBytes bytes(answers_[slot]);
  if (outputs_.echo_particles) bytes.EchoParticles(request);
  return broadcaster_->Publish(std::make_shared<WatchedResult>(std::move(bytes)),
                               request.sequence());
}

std::function<void()> ReconstructCall::Afterwards(bool has_watchers) const {
  if (frames_->assembler() == nullptr && !has_watchers) return {};
  return [assembler = frames_->assembler(), broadcaster = has_watchers ? broadcaster_ : nullptr] {
    if (assembler != nullptr) assembler->TellMembers();
    if (broadcaster != nullptr) broadcaster->Announce();
  };
}

}  // namespace partiemc::server
