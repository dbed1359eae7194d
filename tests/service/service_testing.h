// A server in this process and a plain client of its streams, for tests over gRPC.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "server/server.h"

namespace partiemc::server {

enum class Transport { kInProcess, kTcp };

/// Named "InProcess" and "Tcp" in the names of tests.
std::string TransportName(Transport transport);

/// Port 0 on loopback, two threads, and limits that are quick to reach.
ServerOptions TestOptions();

/// Ends the test as failed where the server does not start.
std::unique_ptr<Server> StartServer(const ServerOptions& options);

/// Looks again and again, for what comes about some milliseconds later: a change of files, the end
/// of a call as the server sees it. False after two minutes.
bool Eventually(const std::function<bool()>& holds);

std::shared_ptr<grpc::Channel> Connect(Server& server, Transport transport);

/// After this a call that hangs fails its test.
void SetDeadline(grpc::ClientContext& context);

/// The reason that the call ended with; empty if none.
std::string ReasonOf(const grpc::ClientContext& context);

/// A request with frame `index` of the moving blob of `seed`, numbered `sequence`.
v1::ReconstructRequest BlobRequest(std::uint64_t sequence, unsigned seed, std::uint64_t index);

/// A request that opens a stream for moving blobs.
v1::ReconstructRequest OpenRequest(const std::string& name = "");

/// One Reconstruct call, driven step by step: a request, then the answers to it.
class StreamClient {
 public:
  explicit StreamClient(const std::shared_ptr<grpc::Channel>& channel);
  /// Cancels a stream that was not finished.
  ~StreamClient();

  /// False once the stream has ended.
  bool Send(const v1::ReconstructRequest& request) { return stream_->Write(request); }
  /// An answer without a case once the stream has ended.
  v1::ReconstructResponse Receive();
  v1::ReconstructResponse SendAndReceive(const v1::ReconstructRequest& request);
  /// Half-closes. Still to receive are the answers, then the end.
  void HalfClose() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  /// Receives and drops what is left; gives the status.
  grpc::Status Finish();
  /// Of the status.
  std::string reason() const { return ReasonOf(context_); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ReconstructRequest, v1::ReconstructResponse>>
      stream_;
  bool finished_ = false;
};

/// One WatchStream call, driven step by step.
class WatchClient {
 public:
  explicit WatchClient(const std::shared_ptr<grpc::Channel>& channel);
  /// Cancels a watch that was not finished.
  ~WatchClient();

  bool Open(const std::string& stream_name, v1::WatchMode mode, std::uint32_t credits,
            std::optional<std::uint64_t> from_sequence = std::nullopt);
  bool Send(const v1::WatchStreamRequest& request) { return rpc_->Write(request); }
  bool Credit(std::uint32_t frames);
  /// A message without a case once the watch has ended.
  v1::WatchStreamResponse Receive();
  void HalfClose() { rpc_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  /// Receives and drops what is left; gives the status.
  grpc::Status Finish();
  /// Of the status.
  std::string reason() const { return ReasonOf(context_); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchStreamRequest, v1::WatchStreamResponse>> rpc_;
  bool finished_ = false;
};

/// How a Reconstruct call ended, and what came before that.
struct StreamEnd {
  grpc::Status status;
  std::string reason;
  std::vector<v1::ReconstructResponse> answers;
};

/// Sends bytes that no message may serialise to as the requests of a stream.
StreamEnd SendBytes(const std::shared_ptr<grpc::Channel>& channel,
                    const std::vector<std::string>& requests);

struct Digests {
  std::uint64_t rings = 0, mesh = 0;

  friend bool operator==(const Digests&, const Digests&) = default;
};

/// Of the first `frames` frames of the moving blob of `seed`, computed in this process without any
/// server, on one thread.
std::vector<Digests> LocalDigests(unsigned seed, std::uint64_t frames);

/// The same over a stream of its own, frame by frame; fails the test where an answer is no result.
std::vector<Digests> StreamedDigests(const std::shared_ptr<grpc::Channel>& channel, unsigned seed,
                                     std::uint64_t frames);

}  // namespace partiemc::server
