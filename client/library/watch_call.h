// One WatchStream call. Its own thread opens the call and reads messages into `ready_`. The credits
// limit the number of messages in `ready_`: if the server sends more, the client cancels the call.
// The receiver's thread decodes messages and returns credits.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/clock.h"
#include "common/mutex.h"
#include "partiemc/client/watcher.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {

/// Used by one thread, except Cancel.
class WatchCall {
 public:
  using TimePoint = Clock::TimePoint;

  /// Requires: `clock` outlives this.
  WatchCall(const std::shared_ptr<grpc::Channel>& channel, std::string address, const Clock& clock)
      : address_(std::move(address)),
        clock_(clock),
        stub_(v1::ReconstructionService::NewStub(channel)) {}
  /// Cancels the call and waits for its thread.
  ~WatchCall();

  /// Starts to open the call without waiting. `from_sequence` replaces options.from_sequence.
  /// `lineage`: lineage() of the call that was lost; empty for a first call.
  void Start(std::string_view stream_name, const WatcherOptions& options,
             std::optional<std::uint64_t> from_sequence, const std::string& lineage = {});
  /// Waits at most until `until`. Returns true if the server has accepted the watcher, false if it
  /// has not responded. Errors: the server's refusal.
  absl::StatusOr<bool> WaitUntilOpened(TimePoint until) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Same as Watcher::Receive. Requires: open.
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Any thread. Current and later calls soon return CANCELLED.
  void Cancel() ABSL_LOCKS_EXCLUDED(mutex_);

  const std::string& address() const { return address_; }
  // Valid when open:
  const WatchedStream& stream() const { return stream_; }
  /// Identifies the stream across resumes and servers. Empty: not supported by the server.
  const std::string& lineage() const { return lineage_; }
  // Valid when ended:
  const WatchEnd& end() const { return end_; }
  /// Reason in the call's status (proto/PROTOCOL.md); empty if there is none.
  std::string reason() ABSL_LOCKS_EXCLUDED(mutex_);
  /// True if the call has ended because the connection, the server or the producer was lost, the
  /// stream was taken over, or the server was short of memory. False if another call would be
  /// refused too, if the call has not ended, and after Cancel.
  bool lost() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Short cause of the end.
  std::string why() ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  using Message = std::unique_ptr<v1::WatchStreamResponse>;

  bool HasNews() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return cancelled_ || !ready_.empty() || status_;
  }
  /// Takes the next message. Returns null if no message arrives before `until` (absent: no limit),
  /// or after an error or the end; then `received` holds the error or the end.
  Message TakeNext(std::optional<TimePoint> until, absl::StatusOr<Received>& received)
      ABSL_LOCKS_EXCLUDED(mutex_);
  void Run(v1::WatchStreamRequest open) ABSL_LOCKS_EXCLUDED(mutex_);
  // Whether the call ended with the server's WatchEnded message and status OK. A status that
  // means a lost connection counts, too, because some proxies lose the status. It does not count
  // after a reason for which the watch rejoins: TAKEN_OVER, PRODUCER_LOST, DRAINING.
  bool HasEnd() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Decode(v1::WatchStreamResponse& message, WatchedFrame& frame);
  absl::Status ExceededCredit() const;
  absl::Status Broken(const char* what) const;

  const std::string address_;
  const Clock& clock_;
  const std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchStreamRequest, v1::WatchStreamResponse>> rpc_;
  // Receiver's thread only:
  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  wire::ReconstructedFrame decoded_;
  v1::ParticleFrame particles_;

  Mutex mutex_;
  CondVar changed_;
  std::deque<Message> ready_ ABSL_GUARDED_BY(mutex_);
  std::vector<Message> spare_ ABSL_GUARDED_BY(mutex_);
  std::optional<grpc::Status> status_ ABSL_GUARDED_BY(mutex_);  // Set after the last read.
  std::string reason_ ABSL_GUARDED_BY(mutex_);                  // Reason in `status_`.
  bool exceeded_credit_ ABSL_GUARDED_BY(mutex_) = false;        // By the server.
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace partiemc::client
