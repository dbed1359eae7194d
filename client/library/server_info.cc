#include "partiemc/client/server_info.h"

#include <grpcpp/grpcpp.h>

#include <memory>

#include "library/channel.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

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
  // The codec knows the enums. It refuses those that this version does not know.
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

}  // namespace

absl::StatusOr<ServerInfo> GetServerInfo(std::string_view address_text,
                                         std::chrono::milliseconds deadline,
                                         const Credentials& credentials) {
  const std::string address(address_text);
  const auto until = std::chrono::system_clock::now() + deadline;
  const auto channel = ConnectedChannel(address, credentials, deadline);
  if (!channel.ok()) return channel.status();

  grpc::ClientContext context;
  context.set_deadline(until);
  v1::GetServerInfoResponse response;
  const auto stub = v1::ReconstructionService::NewStub(*channel);
  const grpc::Status status = stub->GetServerInfo(&context, {}, &response);
  if (!status.ok()) return FromGrpc(status, address);
  return Decode(response);
}

}  // namespace partiemc::client
