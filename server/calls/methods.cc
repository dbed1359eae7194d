#include "server/calls/methods.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <new>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/calls/reconstruct_call.h"
#include "server/calls/requests.h"
#include "server/calls/stream_messages.h"
#include "server/calls/unary_call.h"
#include "server/calls/watch_call.h"
#include "server/stream/session.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

constexpr std::int32_t kMaxPageSize = 1000;

absl::StatusOr<grpc::ByteBuffer> AnswerOrThrow(grpc::ByteBuffer& bytes, const ServerLimits& limits,
                                               Worker& worker, const std::atomic<bool>& cancelled) {
  v1::ReconstructFrameRequest request;
  if (auto status = ParseRequest(bytes, limits.MaxMessageBytes(), request); !status.ok())
    return status;
  const auto parameters = wire::DecodeParameters(request.parameters());
  if (!parameters.ok()) return parameters.status();
  const auto outputs = wire::DecodeOutputs(request.outputs(), request.has_outputs());
  if (!outputs.ok()) return outputs.status();
  auto session = Session::Open(*parameters, limits.frame);
  if (!session.ok()) return session.status();
  v1::ReconstructFrameResponse response;
  wire::EncodeParameters(session->parameters(), *response.mutable_parameters());
  wire::AttributeViews views;
  const absl::Status status = AnswerFrame(
      DecodeFrameWithin(request.frame(), limits, *outputs, views), session->next_sequence(),
      *outputs, *session, worker, cancelled, *response.mutable_frame());
  if (!status.ok()) return status;
  return wire::ToBytes(response);
}

absl::StatusOr<grpc::ByteBuffer> AnswerFrameCall(grpc::ByteBuffer& bytes,
                                                 const ServerLimits& limits, Worker& worker,
                                                 const std::atomic<bool>& cancelled) {
  const std::size_t size = bytes.Length();
  try {
    return AnswerOrThrow(bytes, limits, worker, cancelled);
  } catch (const std::bad_alloc&) {
    return OutOfMemory(absl::StrCat(size, " bytes"));
  }
}

absl::Status BadPage(std::string_view reason, std::string field, std::string value,
                     std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
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
  message.set_watchers(stream.description.broadcaster->watcher_count());
  message.set_open_seconds(seconds_since(stream.opened));
  message.set_idle_seconds(std::max(0.0, seconds_since(stream.counts.last_activity)));
}

}  // namespace

std::string_view Methods::Name(Method method) {
  switch (method) {
    case Method::kReconstruct:
      return "Reconstruct";
    case Method::kReconstructFrame:
      return "ReconstructFrame";
    case Method::kWatchStream:
      return "WatchStream";
    case Method::kListStreams:
      return "ListStreams";
    case Method::kGetServerInfo:
      break;
  }
  return "GetServerInfo";
}

Methods::Methods(const ServerLimits& limits, const Authentication& authentication,
                 OpeningCalls& opening, StreamRegistry& registry, UnaryRegistry& calls,
                 MemoryBudget& budget, ComputePool& pool, WatchRegistry& watchers,
                 WatchDispatcher& dispatcher, const HistoryRoom& history,
                 const CurrentCheckpointKeys& checkpoint_keys, Metrics& metrics)
    : limits_(limits),
      authentication_(authentication),
      opening_(opening),
      registry_(registry),
      calls_(calls),
      budget_(budget),
      pool_(pool),
      watchers_(watchers),
      dispatcher_(dispatcher),
      history_(history),
      checkpoint_keys_(checkpoint_keys),
      meters_(metrics) {}

std::unique_ptr<ByteCall> Methods::Begin(Method method, CallChannel& channel,
                                         const CallOrigin& origin) const {
  switch (method) {
    case Method::kReconstruct:
      return std::make_unique<ReconstructCall>(
          channel, Meters(method), Admit(authentication_, origin, &Caller::CheckMayProduce),
          limits_, opening_, registry_, budget_, pool_, dispatcher_, checkpoint_keys_);
    case Method::kReconstructFrame:
      return ReconstructFrame(channel, origin);
    case Method::kWatchStream:
      return std::make_unique<WatchCall>(channel, Meters(method),
                                         Admit(authentication_, origin, &Caller::CheckMayWatch),
                                         limits_, opening_, registry_, watchers_);
    case Method::kListStreams:
      return Information<v1::ListStreamsRequest>(method, channel, origin, &Caller::CheckMayList,
                                                 [this](const auto& request, const Caller& caller) {
                                                   return ListStreams(request, caller);
                                                 });
    case Method::kGetServerInfo:
      break;
  }
  return Information<v1::GetServerInfoRequest>(
      method, channel, origin, nullptr, [this](const auto&, auto&) {
        return absl::StatusOr<v1::GetServerInfoResponse>(GetServerInfo());
      });
}

std::unique_ptr<ByteCall> Methods::ReconstructFrame(CallChannel& channel,
                                                    const CallOrigin& origin) const {
  auto admission = Admit(authentication_, origin, &Caller::CheckMayProduce);
  // Who is let in alone counts as somebody that a drain turns away.
  if (admission.ok()) {
    if (auto status = registry_.CheckServing(); !status.ok()) admission = std::move(status);
  }
  return std::make_unique<UnaryCall>(
      channel, Meters(Method::kReconstructFrame), std::move(admission), UnaryKind::kFrame, opening_,
      calls_, budget_, &pool_,
      [this](grpc::ByteBuffer& request, Worker* worker, const std::atomic<bool>& cancelled) {
        return AnswerFrameCall(request, limits_, *worker, cancelled);
      });
}

template <typename Request, typename Answer>
std::unique_ptr<ByteCall> Methods::Information(Method method, CallChannel& channel,
                                               const CallOrigin& origin, Permission permission,
                                               Answer answer) const {
  auto admission = Admit(authentication_, origin, permission);
  const Caller caller = admission.ok() ? admission->caller : Caller();
  return std::make_unique<UnaryCall>(
      channel, Meters(method), std::move(admission), UnaryKind::kInformation, opening_, calls_,
      budget_, nullptr,
      [answer, caller](grpc::ByteBuffer& bytes, Worker*,
                       auto&) -> absl::StatusOr<grpc::ByteBuffer> {
        Request request;
        if (auto status = ParseRequest(bytes, kMaxSmallRequestBytes, request); !status.ok())
          return status;
        const auto response = answer(request, caller);
        if (!response.ok()) return response.status();
        return wire::ToBytes(*response);
      });
}

absl::StatusOr<v1::ListStreamsResponse> Methods::ListStreams(const v1::ListStreamsRequest& request,
                                                             const Caller& caller) const {
  if (request.page_size() < 0) {
    return BadPage(kReasonOutOfRange, "page_size", absl::StrCat(request.page_size()),
                   "must be at least 0");
  }
  // A token is the number of the last stream that was listed.
  const std::string& token = request.page_token();
  std::uint64_t after = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), after);
  if (!token.empty() && (error != std::errc() || end != token.data() + token.size())) {
    return BadPage(kReasonPageToken, "page_token", absl::StrCat(token.size(), " characters"),
                   "must be the next_page_token of an answer");
  }
  const std::int32_t asked = request.page_size() > 0 ? request.page_size() : kMaxPageSize;
  const auto page_size = static_cast<std::size_t>(std::min(asked, kMaxPageSize));
  const auto streams = registry_.List(after, page_size + 1, caller);
  const auto now = std::chrono::steady_clock::now();
  v1::ListStreamsResponse response;
  for (std::size_t i = 0; i < std::min(streams.size(), page_size); ++i) {
    EncodeSummary(streams[i], now, *response.add_streams());
  }
  if (streams.size() > page_size) {
    response.set_next_page_token(absl::StrCat(streams[page_size - 1].number));
  }
  return response;
}

v1::GetServerInfoResponse Methods::GetServerInfo() const {
  v1::GetServerInfoResponse response;
  response.set_version(PARTIEMC_VERSION);
  response.set_method_version(kMethodVersion);
  EncodeLimits(limits_, *response.mutable_limits());
  response.set_frames_in_flight(limits_.frames_in_flight);
  response.set_compute_threads(pool_.threads());
  // Those that this build of the core accepts.
  for (const Placement placement : AllPlacements()) {
    ReconstructionParameters parameters;
    parameters.placement = placement;
    if (Reconstructor::Create(parameters).ok()) response.add_placements(wire::ToWire(placement));
  }
  for (const Fill fill : AllFills()) {
    ReconstructionParameters parameters;
    parameters.fill = fill;
    if (Reconstructor::Create(parameters).ok()) response.add_fills(wire::ToWire(fill));
  }
  response.add_capabilities("attributes");
  if (limits_.max_parts > 0) response.add_capabilities("parts");
  response.add_capabilities("resume");
  response.add_capabilities("slices");
  response.add_capabilities("sections");
  response.add_capabilities("watch");
  if (limits_.history_bytes > 0) response.add_capabilities("history");
  response.set_open_streams(static_cast<std::uint32_t>(registry_.OpenCount()));
  response.set_draining(registry_.draining());
  v1::ServerLoad& load = *response.mutable_load();
  load.set_watchers(static_cast<std::uint32_t>(watchers_.count()));
  load.set_frames_waiting(pool_.QueueLength());
  load.set_memory_held(budget_.held());
  load.set_memory_budget(budget_.bytes());
  load.set_watched_bytes(watchers_.held_bytes());
  load.set_history_bytes(history_.held());
  return response;
}

}  // namespace partiemc::server
