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
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/relay/relay.h"
#include "server/relay/stream_summary.h"
#include "server/stream/limits.h"
#include "server/stream/session.h"
#include "server/stream/stream_registry.h"
#include "server/watch/result_history.h"
#include "server/watch/watch_registry.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

constexpr std::int32_t kMaxPageSize = 1000;

// Prefix of page tokens of ListStreams that refer to streams of other replicas.
constexpr std::string_view kRemotePage = "elsewhere:";

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

Methods::Methods(const ServerContext& context, Metrics& metrics)
    : context_(context), meters_(metrics) {}

ArrivedCall Methods::Arrive(Method method, CallChannel& channel, const CallOrigin& origin,
                            Permission permission) const {
  std::string client;
  auto admission = Admit(context_.authentication, origin, permission, client);
  return {channel, &meters_.Of(Name(method)), std::move(admission), std::move(client)};
}

std::unique_ptr<ByteCall> Methods::Begin(Method method, CallChannel& channel,
                                         const CallOrigin& origin) const {
  switch (method) {
    case Method::kReconstruct:
      return std::make_unique<ReconstructCall>(
          Arrive(method, channel, origin, &Caller::CheckMayProduce), context_);
    case Method::kReconstructFrame:
      return ReconstructFrame(channel, origin);
    case Method::kWatchStream:
      return std::make_unique<WatchCall>(Arrive(method, channel, origin, &Caller::CheckMayWatch),
                                         context_);
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
  ArrivedCall call = Arrive(Method::kReconstructFrame, channel, origin, &Caller::CheckMayProduce);
  // Checks this after admission, so that the drain counts only refusals of admitted callers.
  if (call.admission.ok()) {
    auto status = context_.streams.CheckServing();
    if (!status.ok()) call.admission = std::move(status);
  }
  return std::make_unique<UnaryCall>(
      std::move(call), context_, UnaryKind::kFrame,
      [this](grpc::ByteBuffer& request, Worker* worker, const std::atomic<bool>& cancelled) {
        return AnswerFrameCall(request, context_.limits, *worker, cancelled);
      });
}

template <typename Request, typename Answer>
std::unique_ptr<ByteCall> Methods::Information(Method method, CallChannel& channel,
                                               const CallOrigin& origin, Permission permission,
                                               Answer answer) const {
  ArrivedCall call = Arrive(method, channel, origin, permission);
  const Caller caller = call.admission.ok() ? call.admission->caller : Caller();
  return std::make_unique<UnaryCall>(
      std::move(call), context_, UnaryKind::kInformation,
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
  // A page token identifies the last stream of the previous page: by its number, or by its id if
  // another replica has the stream.
  const std::string& token = request.page_token();
  const bool is_local = !token.starts_with(kRemotePage);
  std::uint64_t after = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), after);
  const bool is_number = error == std::errc() && end == token.data() + token.size();
  if (!token.empty() && (is_local ? !is_number : context_.relay == nullptr)) {
    return BadPage(kReasonPageToken, "page_token", absl::StrCat(token.size(), " characters"),
                   "must be the next_page_token of an answer");
  }
  const std::int32_t asked = request.page_size() > 0 ? request.page_size() : kMaxPageSize;
  const auto page_size = static_cast<std::size_t>(std::min(asked, kMaxPageSize));
  v1::ListStreamsResponse response;
  if (!is_local) {
    AddRemoteStreams(token.substr(kRemotePage.size()), page_size, caller, response);
    return response;
  }
  const auto streams = context_.streams.List(after, page_size + 1, caller);
  const auto now = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < std::min(streams.size(), page_size); ++i) {
    if (context_.relay != nullptr &&
        context_.relay->WasResumedElsewhere(streams[i].lineage, streams[i].opened)) {
      continue;  // The other replica lists it.
    }
    EncodeSummary(streams[i], now, *response.add_streams());
  }
  if (streams.size() > page_size) {
    response.set_next_page_token(absl::StrCat(streams[page_size - 1].number));
  } else if (context_.relay != nullptr) {
    AddRemoteStreams("", page_size, caller, response);
  }
  return response;
}

// Adds streams of other replicas with ids above `after`, until the page has `page_size` streams.
void Methods::AddRemoteStreams(const std::string& after, std::size_t page_size,
                               const Caller& caller, v1::ListStreamsResponse& response) const {
  const std::size_t room = page_size - static_cast<std::size_t>(response.streams_size());
  auto streams = context_.relay->List(after, room + 1, caller);
  for (std::size_t i = 0; i < std::min(streams.size(), room); ++i) {
    *response.add_streams() = std::move(*streams[i].mutable_summary());
  }
  if (streams.size() <= room) return;
  const std::string last = room > 0 ? response.streams().rbegin()->stream_id() : after;
  response.set_next_page_token(absl::StrCat(std::string(kRemotePage), last));
}

v1::GetServerInfoResponse Methods::GetServerInfo() const {
  v1::GetServerInfoResponse response;
  response.set_version(PARTIEMC_VERSION);
  response.set_method_version(kMethodVersion);
  EncodeLimits(context_.limits, *response.mutable_limits());
  response.set_frames_in_flight(context_.limits.frames_in_flight);
  response.set_compute_threads(context_.pool.threads());
  // Lists only placements and fills that work, because a build of the core may lack some.
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
  response.add_capabilities("attribute-meshes");
  if (context_.limits.max_parts > 0) response.add_capabilities("parts");
  response.add_capabilities("frame-boxes");
  response.add_capabilities("grains");
  response.add_capabilities("particle-sizes");
  response.add_capabilities("phases");
  response.add_capabilities("periodic-boxes");
  response.add_capabilities("noise-filter");
  response.add_capabilities("resume");
  response.add_capabilities("slices");
  response.add_capabilities("sections");
  response.add_capabilities("surfaces");
  response.add_capabilities("surface-levels");
  response.add_capabilities("walls");
  response.add_capabilities("wall-phases");
  response.add_capabilities("wall-planes");
  response.add_capabilities("surface-sizes");
  response.add_capabilities("wrapped-surfaces");
  if (context_.relay != nullptr) response.add_capabilities("relay");
  response.add_capabilities("watch");
  if (context_.limits.history_bytes > 0) response.add_capabilities("history");
  for (const Doubt doubt : kAllDoubts) {
    v1::DoubtText& text = *response.add_doubts();
    text.set_doubt(wire::ToWire(doubt));
    text.set_name(std::string(partiemc::Name(doubt)));
    text.set_explanation(std::string(Explanation(doubt)));
  }
  response.set_open_streams(static_cast<std::uint32_t>(context_.streams.OpenCount()));
  response.set_draining(context_.streams.draining());
  v1::ServerLoad& load = *response.mutable_load();
  load.set_watchers(static_cast<std::uint32_t>(context_.watchers.count()));
  load.set_frames_waiting(context_.pool.QueueLength());
  load.set_memory_held(context_.budget.held());
  load.set_memory_budget(context_.budget.bytes());
  load.set_watched_bytes(context_.watchers.held_bytes());
  load.set_history_bytes(context_.history.held());
  return response;
}

}  // namespace partiemc::server
