// A watcher that gives all credit and reads nothing: mute_watcher ADDRESS STREAM. After SIGTERM it
// reads the rest, prints the number of dropped frames, and exits.
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include <cstdint>
#include <cstdio>

#include "partiemc/v1/reconstruction.grpc.pb.h"

int main(int argc, char** argv) {
  using namespace partiemc::v1;
  if (argc != 3) return 2;
  // Blocks the signal before gRPC starts threads, so that only sigwait receives it.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  const auto stub = ReconstructionService::NewStub(
      grpc::CreateCustomChannel(argv[1], grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  const auto call = stub->WatchStream(&context);
  WatchStreamRequest request;
  request.mutable_open()->set_stream_name(argv[2]);
  request.mutable_open()->set_credits(1'000'000);
  if (!call->Write(request)) return 1;
  int signal = 0;
  sigwait(&signals, &signal);

  std::uint64_t dropped = 0;
  WatchStreamResponse response;
  while (call->Read(&response)) {
    dropped += response.has_ended() ? response.ended().dropped() : response.frame().dropped();
  }
  std::printf("dropped frames: %llu\n", static_cast<unsigned long long>(dropped));
  return call->Finish().ok() ? 0 : 1;
}
