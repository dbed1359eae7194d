#include "server/calls/watch_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/calls/requests.h"
#include "server/relay/finished_streams.h"
#include "server/relay/watched_result.h"
#include "server/telemetry/logging.h"
#include "server/watch/result_broadcaster.h"
#include "wire/codec.h"
#include "wire/message_bytes.h"
#include "wire/surface_level.h"

namespace partiemc::server {
namespace {

absl::StatusOr<WatchMode> DecodeMode(v1::WatchMode mode) {
  switch (mode) {
    case v1::WATCH_MODE_UNSPECIFIED:
    case v1::WATCH_MODE_LATEST:
      return WatchMode::kLatest;
    case v1::WATCH_MODE_EVERY:
      return WatchMode::kEvery;
    default:
      return ViolationError(absl::StatusCode::kInvalidArgument,
                            {std::string(wire::kReasonUnsupported), "open.mode", absl::StrCat(mode),
                             "must be WATCH_MODE_LATEST or WATCH_MODE_EVERY"});
  }
}

}  // namespace

WatchCall::WatchCall(ArrivedCall call, const ServerContext& context)
    : ByteCall(std::move(call), context),
      machine_(std::make_shared<WatchStateMachine>(static_cast<WatchTransport&>(*this),
                                                   context.limits.max_watcher_bytes)) {
  absl::Status status = admission();
  if (status.ok()) status = context.streams.CheckServing();
  if (status.ok()) status = context.watchers.Enter(machine_);
  if (status.ok()) AllowEviction(machine_);
  machine_->Start(std::move(status));
}

void WatchCall::OnRequest() {
  WatchRequest request;
  parsed_.Clear();
  if (request_.Length() <= kMaxSmallRequestBytes && wire::MergeBytes(request_, parsed_)) {
    using Kind = WatchRequest::Kind;
    request.kind = parsed_.has_open()     ? Kind::kOpen
                   : parsed_.has_credit() ? Kind::kCredit
                                          : Kind::kEmpty;
    request.credit = parsed_.credit().frames();
  }
  request_.Clear();
  machine_->ReadDone(request);
}

void WatchCall::OnResponseWritten(bool ok) {
  response_.Clear();
  machine_->WriteDone(ok);
}

void WatchCall::OnCancel() {
  const auto machine = machine_;  // This call may be deleted after the first event.
  if (context().levels.Withdraw(*this)) machine->WriteDone(false);
  machine->Cancelled();
}

void WatchCall::Cut() {
  channel().Cancel();
  if (context().levels.Withdraw(*this)) machine_->WriteDone(false);
}

void WatchCall::OnDone() { context().watchers.Leave(*machine_); }

void WatchCall::StartRead() {
  if (!stream_name_.empty()) AllowWatcherEviction(machine_);
  channel().StartRead(&request_);
}

absl::StatusOr<WatchTerms> WatchCall::ReadTerms() const {
  const v1::OpenWatch& open = parsed_.open();
  const auto mode = DecodeMode(open.mode());
  if (!mode.ok()) return mode.status();
  if (open.credits() == 0) {
    return ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(kReasonOutOfRange), "open.credits", "0", "must be at least 1"});
  }
  WatchTerms terms{.broadcaster = nullptr, .mode = *mode, .credit = open.credits()};
  if (open.has_from_sequence()) terms.from_sequence = open.from_sequence();
  return terms;
}

// Looks up the stream. Each path ends with a call of `Opened`, after which this call may have been
// deleted.
void WatchCall::StartOpen() {
  auto terms = ReadTerms();
  if (!terms.ok()) return machine_->Opened(terms.status());
  terms_ = *std::move(terms);
  const std::string name = parsed_.open().stream_name();
  const auto stream = context().streams.Find(name, caller());
  const bool is_elsewhere =
      context().relay != nullptr &&
      (stream.ok() ? context().relay->WasResumedElsewhere(stream->lineage, stream->opened)
                   : absl::IsNotFound(stream.status()));
  if (!is_elsewhere) {
    absl::Status status = stream.ok() ? OpenHere(*stream) : stream.status();
    if (absl::IsNotFound(status)) status = OpenFinished(name, status);
    return machine_->Opened(status.ok() ? absl::StatusOr<WatchTerms>(terms_) : status);
  }
  context().relay->Find(
      name, terms_.from_sequence, [this, name](const absl::StatusOr<Relay::Found>& found) {
        absl::Status status = found.ok() ? OpenRemote(*found) : found.status();
        if (absl::IsNotFound(status)) {  // The stream may have moved here, or finished.
          const auto here = context().streams.Find(name, caller());
          status = here.ok() ? OpenHere(*here) : OpenFinished(name, status);
        }
        machine_->Opened(status.ok() ? absl::StatusOr<WatchTerms>(terms_) : status);
      });
}

absl::Status WatchCall::OpenHere(const StreamSummary& stream) {
  const StreamDescription& description = stream.description;
  terms_.broadcaster = description.broadcaster;
  const bool has_surfaces = description.parameters.output == Output::kSurface;
  if (auto status = JoinLevel(has_surfaces); !status.ok()) return status;
  if (auto status = TakePlace(stream.id, description.name); !status.ok()) return status;
  v1::WatchOpened& opened = *opened_.mutable_opened();
  opened.set_lineage(stream.lineage);
  wire::EncodeParameters(description.parameters, *opened.mutable_parameters());
  opened.mutable_labels()->insert(description.labels.begin(), description.labels.end());
  return absl::OkStatus();
}

// Joins the level that the watcher requests, if any, of the stream in terms_.
absl::Status WatchCall::JoinLevel(bool has_surfaces) {
  if (!parsed_.open().has_level_of_detail()) return absl::OkStatus();
  if (!has_surfaces) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {std::string(wire::kReasonUnsupported), "open.level_of_detail", "set",
                           "must be absent: the stream has outlines, not surfaces"});
  }
  auto level = wire::DecodeLevelOfDetail(parsed_.open().level_of_detail());
  if (!level.ok()) return level.status();
  auto seat = context().levels.Join(terms_.broadcaster.get(), *level);
  if (seat.ok()) level_ = *std::move(seat);
  return seat.status();
}

absl::Status WatchCall::OpenRemote(const Relay::Found& found) {
  const v1::StreamSummary& stream = found.stream.summary();
  terms_.broadcaster = found.broadcaster;
  const bool has_surfaces = stream.parameters().output() == v1::OUTPUT_SURFACE;
  if (auto status = JoinLevel(has_surfaces); !status.ok()) return status;
  if (auto status = TakePlace(stream.stream_id(), stream.stream_name()); !status.ok())
    return status;
  v1::WatchOpened& opened = *opened_.mutable_opened();
  opened.set_lineage(found.stream.lineage());
  *opened.mutable_parameters() = stream.parameters();
  *opened.mutable_labels() = stream.labels();
  return absl::OkStatus();
}

// Opens the watch of a stream that has finished. Returns `not_found` if it has not.
absl::Status WatchCall::OpenFinished(const std::string& name, const absl::Status& not_found) {
  auto stream = context().finished.Find(name, parsed_.open().lineage());
  if (!stream) return not_found;
  finished_sequence_ = stream->summary().last_sequence();
  auto broadcaster =
      std::make_shared<ResultBroadcaster>(context().dispatcher, ResultBroadcaster::Limits{});
  broadcaster->End(WatchEnd::OfStream(absl::OkStatus()));
  return OpenRemote({std::move(broadcaster), *std::move(stream)});
}

absl::Status WatchCall::TakePlace(const std::string& stream_id, const std::string& stream_name) {
  if (auto status = context().watchers.Open(*machine_, caller()); !status.ok()) return status;
  stream_name_ = stream_name;
  opened_.mutable_opened()->set_stream_id(stream_id);
  LogCall("watch opened", {{"stream", stream_id},
                           {"name", stream_name_},
                           {"mode", terms_.mode == WatchMode::kEvery ? "every" : "latest"},
                           {"peer", channel().peer()},
                           {"client", caller().name()}});
  return absl::OkStatus();
}

void WatchCall::WriteOpened(const HeldFrames& held) {
  v1::WatchOpened& opened = *opened_.mutable_opened();
  const bool finished = finished_sequence_ != 0;
  opened.set_oldest_sequence(finished ? finished_sequence_ : held.oldest);
  opened.set_newest_sequence(finished ? finished_sequence_ : held.newest);
  opened.set_has_frames(finished || held.any);
  Write(wire::ToBytes(opened_));
}

void WatchCall::WriteFrame(const Published& published, std::uint64_t dropped,
                           std::uint64_t oldest_sequence) {
  if (level_) {
    level_dropped_ = dropped;
    level_oldest_ = oldest_sequence;
    // A watcher that starts in the history receives every frame of it.
    const bool may_skip = terms_.mode == WatchMode::kLatest && !terms_.from_sequence;
    return context().levels.Request(level_, published.frame, may_skip, *this);
  }
  const auto& result = static_cast<const WatchedResult&>(*published.frame);
  Write(result.bytes.ToResponse(dropped, oldest_sequence));
}

void WatchCall::LevelDone(const absl::StatusOr<LevelQueue::Frame>& level) {
  if (!level.ok()) return machine_->WriteRefused(level.status());
  if (*level == nullptr) return machine_->WriteSkipped();
  const auto& result = static_cast<const WatchedResult&>(**level);
  Write(result.bytes.ToResponse(level_dropped_, level_oldest_));
}

void WatchCall::WriteEnded(const WatchEnd& end, std::uint64_t dropped) {
  end_reason_ = end.reason;
  v1::WatchStreamResponse response;
  response.mutable_ended()->set_reason(end.reason);
  response.mutable_ended()->set_message(end.message);
  response.mutable_ended()->set_dropped(dropped);
  Write(wire::ToBytes(response));
}

void WatchCall::Write(grpc::ByteBuffer response) {
  response_.Swap(&response);
  channel().StartWrite(&response_);
}

void WatchCall::Finish(const absl::Status& status) {
  // Frees the watcher's slot before it sends the status, because a client that receives the status
  // may watch again at once.
  context().watchers.Close(*machine_);
  level_ = {};
  LogEnd(status);
  End(status);
}

void WatchCall::LogEnd(const absl::Status& status) const {
  if (stream_name_.empty()) {
    LogRefusal("watch refused", channel().peer(), status, client());
    return;
  }
  const std::chrono::duration<double> open = std::chrono::steady_clock::now() - came_;
  const WatchCounts counts = machine_->counts();
  const auto violation = FindViolation(status);
  const std::string reason = !end_reason_.empty() ? end_reason_
                             : violation          ? violation->reason
                                                  : "LEFT";
  LogCall("watch closed", {{"stream", opened_.opened().stream_id()},
                           {"name", stream_name_},
                           {"frames", counts.frames},
                           {"dropped", counts.dropped},
                           {"most_held_bytes", std::uint64_t{counts.most_held_bytes}},
                           {"seconds", open.count()},
                           {"reason", reason},
                           {"status", absl::StatusCodeToString(status.code())}});
}

}  // namespace partiemc::server
