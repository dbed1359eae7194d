#include "partiemc/client/stream_list.h"

#include <grpcpp/grpcpp.h>

#include <memory>

#include "library/channel.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

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
  // A newer server may have parameters that this version does not know: the rest is told anyway.
  const auto parameters = wire::DecodeParameters(message.parameters());
  if (parameters.ok()) summary.parameters = *parameters;
  return summary;
}

}  // namespace

absl::StatusOr<std::vector<StreamSummary>> ListStreams(std::string_view address_text,
                                                       std::chrono::milliseconds deadline,
                                                       const Credentials& credentials) {
  const std::string address(address_text);
  const auto until = std::chrono::system_clock::now() + deadline;
  const auto channel = ConnectedChannel(address, credentials, deadline);
  if (!channel.ok()) return channel.status();

  const auto stub = v1::ReconstructionService::NewStub(*channel);
  std::vector<StreamSummary> streams;
  v1::ListStreamsRequest request;
  do {
    grpc::ClientContext context;
    context.set_deadline(until);
    v1::ListStreamsResponse page;
    const grpc::Status status = stub->ListStreams(&context, request, &page);
    if (!status.ok()) return FromGrpc(status, address);
    for (const v1::StreamSummary& stream : page.streams()) streams.push_back(Decode(stream));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return streams;
}

}  // namespace partiemc::client
