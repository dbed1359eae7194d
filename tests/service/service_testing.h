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

/// "InProcess" or "Tcp", for names of tests.
std::string TransportName(Transport transport);

/// Port 0 on loopback, two threads, and low limits.
ServerOptions TestOptions();

/// Fails the test if the server does not start.
std::unique_ptr<Server> StartServer(const ServerOptions& options);

/// Polls a condition that becomes true some milliseconds later: a reloaded file, or a call that the
/// server sees end. False after two minutes.
bool Eventually(const std::function<bool()>& holds);

/// The response to an HTTP GET, header and body.
std::string Get(const Address& address, const std::string& path);

std::shared_ptr<grpc::Channel> Connect(Server& server, Transport transport);

/// Sets a deadline, so that a hanging call fails its test.
void SetDeadline(grpc::ClientContext& context);

/// The context of a call with this deadline.
struct TimedContext final : grpc::ClientContext {
  TimedContext() { SetDeadline(*this); }
};

/// The reason of the call's end; empty if there is none.
std::string ReasonOf(const grpc::ClientContext& context);

/// Version, limits and load of a server; fails the test if it does not answer.
v1::GetServerInfoResponse InfoOf(const std::shared_ptr<grpc::Channel>& channel);

/// A request with frame `index` of the moving blob of `seed`, numbered `sequence`.
v1::ReconstructRequest BlobRequest(std::uint64_t sequence, unsigned seed, std::uint64_t index);

/// A request that opens a stream for moving blobs.
v1::ReconstructRequest OpenRequest(const std::string& name = "");

/// One Reconstruct call, driven step by step: a request, then its responses.
class StreamClient {
 public:
  explicit StreamClient(const std::shared_ptr<grpc::Channel>& channel);
  /// Cancels an unfinished stream.
  ~StreamClient();

  /// False after the end of the stream.
  bool Send(const v1::ReconstructRequest& request) { return stream_->Write(request); }
  /// An empty response after the end of the stream.
  v1::ReconstructResponse Receive();
  v1::ReconstructResponse SendAndReceive(const v1::ReconstructRequest& request);
  /// Half-closes. Responses and the end are still received.
  void HalfClose() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  /// Drops the remaining responses; returns the status.
  grpc::Status Finish();
  /// Reason in the status.
  std::string reason() const { return ReasonOf(context_); }

 private:
  TimedContext context_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ReconstructRequest, v1::ReconstructResponse>>
      stream_;
  bool finished_ = false;
};

/// One WatchStream call, driven step by step.
class WatchClient {
 public:
  explicit WatchClient(const std::shared_ptr<grpc::Channel>& channel);
  /// Opens the watch, too.
  WatchClient(const std::shared_ptr<grpc::Channel>& channel, const std::string& stream_name,
              v1::WatchMode mode, std::uint32_t credits,
              std::optional<std::uint64_t> from_sequence = std::nullopt)
      : WatchClient(channel) {
    Open(stream_name, mode, credits, from_sequence);
  }
  /// Cancels an unfinished watch.
  ~WatchClient();

  bool Open(const std::string& stream_name, v1::WatchMode mode, std::uint32_t credits,
            std::optional<std::uint64_t> from_sequence = std::nullopt);
  bool Send(const v1::WatchStreamRequest& request) { return rpc_->Write(request); }
  bool Credit(std::uint32_t frames);
  /// An empty message after the end of the watch.
  v1::WatchStreamResponse Receive();
  void HalfClose() { rpc_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  /// Drops the remaining messages; returns the status.
  grpc::Status Finish();
  /// Reason in the status.
  std::string reason() const { return ReasonOf(context_); }

 private:
  TimedContext context_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchStreamRequest, v1::WatchStreamResponse>> rpc_;
  bool finished_ = false;
};

/// The end of a Reconstruct call, and the responses before it.
struct StreamEnd {
  grpc::Status status;
  std::string reason;
  std::vector<v1::ReconstructResponse> answers;
};

/// Sends bytes that no message serialises to as the requests of a stream.
StreamEnd SendBytes(const std::shared_ptr<grpc::Channel>& channel,
                    const std::vector<std::string>& requests);

struct Digests {
  std::uint64_t rings = 0, mesh = 0;

  friend bool operator==(const Digests&, const Digests&) = default;
};

/// Digests of the first `frames` frames of blob `seed`, computed in this process without a server,
/// on one thread.
std::vector<Digests> LocalDigests(unsigned seed, std::uint64_t frames);

/// The same over a stream, one frame at a time; fails the test unless each answer is a result.
std::vector<Digests> StreamedDigests(const std::shared_ptr<grpc::Channel>& channel, unsigned seed,
                                     std::uint64_t frames);

}  // namespace partiemc::server
