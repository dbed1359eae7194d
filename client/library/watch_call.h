// One WatchStream call. A thread of its own opens it and reads; what it has read waits in `ready_`,
// which credit bounds. The receiver's thread decodes and gives the credit back.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/watcher.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {

/// Used by one thread, but for Cancel.
class WatchCall {
 public:
  using Clock = std::chrono::steady_clock;

  WatchCall(const std::shared_ptr<grpc::Channel>& channel, std::string address)
      : address_(std::move(address)), stub_(v1::ReconstructionService::NewStub(channel)) {}
  /// Cancels.
  ~WatchCall();

  /// Begins to open, in place of options.from_sequence with `from_sequence`; waits for nothing.
  void Start(std::string_view stream_name, const WatcherOptions& options,
             std::optional<std::uint64_t> from_sequence);
  /// Whether the server has accepted the watcher; waits for that until then at most.
  /// Errors: what it was refused for.
  absl::StatusOr<bool> WaitUntilOpened(Clock::time_point until);
  /// As Watcher::Receive, once open.
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait);
  /// Any thread: what waits returns CANCELLED soon, and so does all that comes.
  void Cancel();

  const std::string& address() const { return address_; }
  // Once open:
  const WatchedStream& stream() const { return stream_; }
  const std::string& lineage() const { return lineage_; }
  // Once ended:
  const WatchEnd& end() const { return end_; }
  /// Of the status; empty if none.
  std::string reason();
  /// Whether the connection, the server or the producer is gone, rather than anything said that
  /// another call would be told as well.
  bool lost();
  /// Why it has ended, in a few words.
  std::string why();

 private:
  using Message = std::unique_ptr<v1::WatchStreamResponse>;

  void Run(v1::WatchStreamRequest open);
  absl::Status Decode(v1::WatchStreamResponse& message, WatchedFrame& frame);
  absl::Status Broken(const char* what) const;

  const std::string address_;
  const std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchStreamRequest, v1::WatchStreamResponse>> rpc_;
  // Of the receiver's thread:
  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  wire::ReconstructedFrame decoded_;
  v1::ParticleFrame particles_;

  std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<Message> ready_;
  std::vector<Message> spare_;
  std::optional<grpc::Status> status_;  // Once nothing more will be read.
  std::string reason_;                  // Of it.
  bool cancelled_ = false;
  std::thread thread_;
};

}  // namespace partiemc::client
