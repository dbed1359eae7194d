// A server whose streams and watches follow a test's script, valid or not.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::client {

class FakeServer final : private v1::ReconstructionService::Service {
 public:
  using Rpc = grpc::ServerReaderWriter<v1::ReconstructResponse, v1::ReconstructRequest>;
  using Script = std::function<grpc::Status(grpc::ServerContext&, Rpc&)>;
  using WatchRpc = grpc::ServerReaderWriter<v1::WatchStreamResponse, v1::WatchStreamRequest>;
  using WatchScript = std::function<grpc::Status(grpc::ServerContext&, WatchRpc&)>;

  /// Listens on a free loopback port; `script` handles each stream, `watch_script` each watch.
  explicit FakeServer(Script script, WatchScript watch_script = {});
  ~FakeServer() override;

  std::string address() const;

 private:
  grpc::Status Reconstruct(grpc::ServerContext* context, Rpc* rpc) override;
  grpc::Status WatchStream(grpc::ServerContext* context, WatchRpc* rpc) override;
  grpc::Status GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest* request,
                             v1::GetServerInfoResponse* response) override;

  const Script script_;
  const WatchScript watch_script_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

/// Reads OpenStream and accepts it with a window of `frames_in_flight`.
v1::OpenStream Accept(FakeServer::Rpc& rpc, std::uint32_t frames_in_flight,
                      std::uint64_t max_frame_bytes = 1 << 20);

/// The next frame; false when the client has finished.
bool ReadFrame(FakeServer::Rpc& rpc, v1::ParticleFrame& frame);

/// An answer to `frame` with one triangle at its first particle.
v1::ReconstructResponse TriangleAt(const v1::ParticleFrame& frame);

/// Accepts the stream and answers every frame.
grpc::Status AnswerAll(grpc::ServerContext& context, FakeServer::Rpc& rpc);

/// Returns when the client has cancelled.
grpc::Status WaitForCancel(grpc::ServerContext& context);

}  // namespace partiemc::client
