// Unary queries of a server.
#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "client/library/channel.h"
#include "common/clock.h"
#include "partiemc/client/server_info.h"
#include "partiemc/client/stream_list.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

using Stub = v1::ReconstructionService::Stub;

// A connection for several calls that share one deadline.
class Query {
 public:
  static absl::StatusOr<Query> Connect(std::string_view address, std::chrono::milliseconds deadline,
                                       const Credentials& credentials) {
    Query query;
    query.address_ = address;
    query.until_ = SystemClock().TimeOfDay() + deadline;
    const auto channel = ConnectedChannel(query.address_, credentials, deadline);
    if (!channel.ok()) return channel.status();
    query.stub_ = v1::ReconstructionService::NewStub(*channel);
    return query;
  }

  template <typename Request, typename Response>
  absl::Status Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response& response) {
    grpc::ClientContext context;
    context.set_deadline(until_);
    return FromGrpc(((*stub_).*method)(&context, request, &response), address_);
  }

 private:
  std::string address_;
  std::chrono::system_clock::time_point until_;
  std::unique_ptr<Stub> stub_;
};

ServerInfo Decode(const v1::GetServerInfoResponse& message) {
  ServerInfo info{.version = message.version(),
                  .method_version = message.method_version(),
                  .limits = {.max_particles_per_frame = message.limits().max_particles_per_frame(),
                             .max_frame_bytes = message.limits().max_frame_bytes(),
                             .max_tiles_per_frame = message.limits().max_tiles_per_frame()},
                  .max_streams = message.limits().max_streams(),
                  .max_watchers = message.limits().max_watchers(),
                  .idle_timeout_seconds = message.limits().idle_timeout_seconds(),
                  .frames_in_flight = message.frames_in_flight(),
                  .compute_threads = message.compute_threads(),
                  .capabilities = {message.capabilities().begin(), message.capabilities().end()},
                  .open_streams = message.open_streams(),
                  .draining = message.draining()};
  if (message.has_load()) {
    info.load = {.watchers = message.load().watchers(),
                 .frames_waiting = message.load().frames_waiting(),
                 .memory_held = message.load().memory_held(),
                 .memory_budget = message.load().memory_budget(),
                 .watched_bytes = message.load().watched_bytes()};
  }
  // The codec rejects placements that this version does not know; they are left out.
  for (const int placement : message.placements()) {
    v1::ReconstructionParameters parameters;
    parameters.set_placement(static_cast<v1::Placement>(placement));
    const auto decoded = wire::DecodeParameters(parameters);
    if (decoded.ok()) info.placements.push_back(decoded->placement);
  }
  for (const int fill : message.fills()) {
    v1::ReconstructionParameters parameters;
    parameters.set_fill(static_cast<v1::Fill>(fill));
    const auto decoded = wire::DecodeParameters(parameters);
    if (decoded.ok()) info.fills.push_back(decoded->fill);
  }
  return info;
}

StreamSummary Decode(const v1::StreamSummary& message) {
  StreamSummary summary{.stream_id = message.stream_id(),
                        .name = message.stream_name(),
                        .labels = {message.labels().begin(), message.labels().end()},
                        .last_sequence = message.last_sequence(),
                        .frames = message.frames(),
                        .frame_errors = message.frame_errors(),
                        .watchers = message.watchers(),
                        .open_seconds = message.open_seconds(),
                        .idle_seconds = message.idle_seconds()};
  // A newer server may have unknown parameters; the other fields are still valid.
  const auto parameters = wire::DecodeParameters(message.parameters());
  if (parameters.ok()) summary.parameters = *parameters;
  return summary;
}

}  // namespace

absl::StatusOr<ServerInfo> GetServerInfo(std::string_view address,
                                         std::chrono::milliseconds deadline,
                                         const Credentials& credentials) {
  auto query = Query::Connect(address, deadline, credentials);
  if (!query.ok()) return query.status();
  v1::GetServerInfoResponse response;
  const auto status = query->Call(&Stub::GetServerInfo, {}, response);
  if (!status.ok()) return status;
  return Decode(response);
}

absl::StatusOr<std::vector<StreamSummary>> ListStreams(std::string_view address,
                                                       std::chrono::milliseconds deadline,
                                                       const Credentials& credentials) {
  auto query = Query::Connect(address, deadline, credentials);
  if (!query.ok()) return query.status();
  std::vector<StreamSummary> streams;
  v1::ListStreamsRequest request;
  do {
    v1::ListStreamsResponse page;
    const auto status = query->Call(&Stub::ListStreams, request, page);
    if (!status.ok()) return status;
    for (const v1::StreamSummary& stream : page.streams()) streams.push_back(Decode(stream));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return streams;
}

}  // namespace partiemc::client
