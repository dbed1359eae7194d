#include "server/service.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/call_guard.h"
#include "server/grpc_status.h"
#include "server/reconstruct_reactor.h"
#include "server/stream_messages.h"
#include "server/watch_reactor.h"

namespace partiemc::server {
namespace {

constexpr std::int32_t kMaxPageSize = 1000;

absl::Status AnswerCall(const v1::ReconstructFrameRequest& request, const ServerLimits& limits,
                        Worker& worker, v1::ReconstructFrameResponse& response) {
  const auto parameters = wire::DecodeParameters(request.parameters());
  if (!parameters.ok()) return parameters.status();
  const auto outputs = wire::DecodeOutputs(request.outputs(), request.has_outputs());
  if (!outputs.ok()) return outputs.status();
  auto session = Session::Open(*parameters, limits.frame);
  if (!session.ok()) return session.status();
  wire::EncodeParameters(session->parameters(), *response.mutable_parameters());
  return AnswerFrame(DecodeFrameWithin(request.frame(), limits), session->next_sequence(), *outputs,
                     *session, worker, *response.mutable_frame());
}

// RESOURCE_EXHAUSTED with the Violation of what is not let in.
absl::Status Refused(std::string_view reason, std::string field, std::string value,
                     std::string rule) {
  return ViolationError(absl::StatusCode::kResourceExhausted,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

// Ends a call as soon as it comes.
class RefusedStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit RefusedStream(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

grpc::ServerUnaryReactor* Refuse(const absl::Status& status, grpc::CallbackServerContext& context) {
  grpc::ServerUnaryReactor* reactor = context.DefaultReactor();
  reactor->Finish(ToGrpcStatus(status, context));
  return reactor;
}

void EncodeSummary(const StreamSummary& stream, std::chrono::steady_clock::time_point now,
                   v1::StreamSummary& message) {
  const auto seconds_since = [now](std::chrono::steady_clock::time_point then) {
    return std::chrono::duration<double>(now - then).count();
  };
  message.set_stream_id(stream.id);
  message.set_stream_name(stream.description.name);
  message.mutable_labels()->insert(stream.description.labels.begin(),
                                   stream.description.labels.end());
  wire::EncodeParameters(stream.description.parameters, *message.mutable_parameters());
  message.set_last_sequence(stream.counts.last_sequence);
  message.set_frames(stream.counts.frames);
  message.set_frame_errors(stream.counts.frame_errors);
  message.set_watchers(stream.description.hub->watcher_count());
  message.set_open_seconds(seconds_since(stream.opened));
  message.set_idle_seconds(std::max(0.0, seconds_since(stream.counts.last_activity)));
}

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Service::Reconstruct(
    grpc::CallbackServerContext* context) {
  auto client = Authenticate(authentication_, *context);
  if (!client.ok()) return new RefusedStream(ToGrpcStatus(client.status(), *context));
  return new ReconstructReactor(*context, limits_, registry_, budget_, pool_, pump_,
                                *std::move(client));
}

absl::Status Service::LetCallIn(std::uint64_t bytes) {
  if (auto status = registry_.CheckServing(); !status.ok()) return status;
  if (++calls_ > limits_.max_streams) {
    --calls_;
    return Refused(kReasonTooManyCalls, "calls of ReconstructFrame",
                   absl::StrCat(limits_.max_streams, " going on"),
                   absl::StrCat("must be at most ", limits_.max_streams, "; try again later"));
  }
  if (!budget_.TryTake(bytes)) {
    --calls_;
    return Refused(kReasonMemoryBudget, "request", absl::StrCat(bytes, " bytes"),
                   absl::StrCat("must fit with what is being worked on into ", budget_.bytes(),
                                " bytes; try again later, or start the server with a larger "
                                "--memory-budget"));
  }
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* Service::ReconstructFrame(grpc::CallbackServerContext* context,
                                                    const v1::ReconstructFrameRequest* request,
                                                    v1::ReconstructFrameResponse* response) {
  if (auto client = Authenticate(authentication_, *context); !client.ok()) {
    return Refuse(client.status(), *context);
  }
  const std::uint64_t bytes = request->ByteSizeLong();
  if (auto status = LetCallIn(bytes); !status.ok()) return Refuse(status, *context);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  pool_.Submit([=, this](Worker& worker) {
    const auto status = context->IsCancelled() ? absl::CancelledError("the client went away")
                                               : AnswerCall(*request, limits_, worker, *response);
    --calls_;
    budget_.GiveBack(bytes);
    reactor->Finish(ToGrpcStatus(status, *context));
  });
  return reactor;
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Service::WatchStream(
    grpc::CallbackServerContext* context) {
  auto client = Authenticate(authentication_, *context);
  if (!client.ok()) return new RefusedStream(ToGrpcStatus(client.status(), *context));
  return new WatchReactor(*context, limits_, registry_, watchers_, *std::move(client));
}

grpc::ServerUnaryReactor* Service::ListStreams(grpc::CallbackServerContext* context,
                                               const v1::ListStreamsRequest* request,
                                               v1::ListStreamsResponse* response) {
  if (auto client = Authenticate(authentication_, *context); !client.ok()) {
    return Refuse(client.status(), *context);
  }
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  // A token is the number of the last stream that was listed.
  const std::string& token = request->page_token();
  std::uint64_t after = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), after);
  if (!token.empty() && (error != std::errc() || end != token.data() + token.size())) {
    reactor->Finish({grpc::StatusCode::INVALID_ARGUMENT,
                     "page_token: not from here; must be the next_page_token of an answer"});
    return reactor;
  }
  const std::int32_t asked = request->page_size() > 0 ? request->page_size() : kMaxPageSize;
  const auto page_size = static_cast<std::size_t>(std::min(asked, kMaxPageSize));
  const auto streams = registry_.List(after, page_size + 1);
  const auto now = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < std::min(streams.size(), page_size); ++i) {
    EncodeSummary(streams[i], now, *response->add_streams());
  }
  if (streams.size() > page_size) {
    response->set_next_page_token(absl::StrCat(streams[page_size - 1].number));
  }
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* Service::GetServerInfo(grpc::CallbackServerContext* context,
                                                 const v1::GetServerInfoRequest*,
                                                 v1::GetServerInfoResponse* response) {
  const auto client = Authenticate(authentication_, *context);
  if (!client.ok()) return Refuse(client.status(), *context);
  response->set_version(PARTIEMC_VERSION);
  response->set_method_version(kMethodVersion);
  EncodeLimits(limits_, *response->mutable_limits());
  response->set_frames_in_flight(limits_.frames_in_flight);
  response->set_compute_threads(pool_.threads());
  // Those that this build of the core accepts.
  for (const Placement placement : AllPlacements()) {
    ReconstructionParameters parameters;
    parameters.placement = placement;
    if (Reconstructor::Create(parameters).ok()) response->add_placements(wire::ToWire(placement));
  }
  for (const Fill fill : AllFills()) {
    ReconstructionParameters parameters;
    parameters.fill = fill;
    if (Reconstructor::Create(parameters).ok()) response->add_fills(wire::ToWire(fill));
  }
  response->add_capabilities("resume");
  response->add_capabilities("watch");
  response->set_open_streams(static_cast<std::uint32_t>(registry_.OpenCount()));
  response->set_draining(registry_.draining());
  v1::ServerLoad& load = *response->mutable_load();
  load.set_watchers(static_cast<std::uint32_t>(watchers_.count()));
  load.set_frames_waiting(pool_.QueueLength());
  load.set_memory_held(budget_.held());
  load.set_memory_budget(budget_.bytes());
  load.set_watched_bytes(watchers_.held_bytes());
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace partiemc::server
