// One WatchStream call. Its thread opens the call and reads messages into `ready_`; the credits
// bound their number. The receiver's thread decodes them and returns the credits.
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

/// Used by one thread, except Cancel.
class WatchCall {
 public:
  using Clock = std::chrono::steady_clock;

  WatchCall(const std::shared_ptr<grpc::Channel>& channel, std::string address)
      : address_(std::move(address)), stub_(v1::ReconstructionService::NewStub(channel)) {}
  /// Cancels.
  ~WatchCall();

  /// Starts to open the call without waiting. `from_sequence` replaces options.from_sequence.
  void Start(std::string_view stream_name, const WatcherOptions& options,
             std::optional<std::uint64_t> from_sequence);
  /// Waits at most until `until`; true if the server has accepted the watcher. Errors: the server's
  /// refusal.
  absl::StatusOr<bool> WaitUntilOpened(Clock::time_point until);
  /// Same as Watcher::Receive. Requires: open.
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait);
  /// Any thread. Current and later calls soon return CANCELLED.
  void Cancel();

  const std::string& address() const { return address_; }
  // Valid when open:
  const WatchedStream& stream() const { return stream_; }
  const std::string& lineage() const { return lineage_; }
  // Valid when ended:
  const WatchEnd& end() const { return end_; }
  /// Reason in the status; empty if there is none.
  std::string reason();
  /// True if the connection, the server or the producer was lost. False if another call would be
  /// refused too.
  bool lost();
  /// Short cause of the end.
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
  // Receiver's thread only:
  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  wire::ReconstructedFrame decoded_;
  v1::ParticleFrame particles_;

  std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<Message> ready_;
  std::vector<Message> spare_;
  std::optional<grpc::Status> status_;  // Set after the last read.
  std::string reason_;                  // Reason in `status_`.
  bool cancelled_ = false;
  std::thread thread_;
};

}  // namespace partiemc::client
