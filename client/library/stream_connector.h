// Opens the calls of a stream: the first one, and a new one after each loss.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/retry_loop.h"
#include "client/library/retry_policy.h"
#include "client/library/stream_call.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {

/// Used by the receiver's thread only, except Cancel. Methods that require the monitor's mutex
/// release it while they wait.
class StreamConnector {
 public:
  using TimePoint = Clock::TimePoint;

  struct Opened {
    std::unique_ptr<StreamCall> call;
    v1::StreamOpened message;
  };

  /// `monitor` must outlive this object. Requires: at least one address.
  StreamConnector(Monitor& monitor, std::vector<std::string> addresses,
                  const StreamOptions& options);

  Mutex& mutex() const ABSL_LOCK_RETURNED(monitor_.mutex) { return monitor_.mutex; }

  /// Opens a new stream at the first address that accepts it. Errors: see Stream::Open.
  absl::StatusOr<Opened> OpenNew() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  /// Replaces the addresses learned from earlier notices by those of `notice`, for failover. Leaves
  /// out Unix sockets, and addresses to which the token may not be sent.
  void Learn(const v1::StreamNotice& notice);
  /// Records that the stream lost its call; OpenAgain then resumes the stream with `resume`. Until
  /// Recovered, further losses count as part of this one.
  void Lost(const Loss& loss, v1::ResumeStream resume);
  /// Continues to reconnect: waits, connects, opens. Returns nothing if no call is open at `until`.
  /// Errors: the server's refusal; UNAVAILABLE after ReconnectPolicy::give_up_after; CANCELLED
  /// after Cancel.
  absl::StatusOr<std::optional<Opened>> OpenAgain(std::optional<TimePoint> until)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  /// Ends the loss: a new result was delivered.
  void Recovered() { retry_.Recovered(); }

  /// Absent unless the stream reconnects.
  std::optional<Reconnecting> Progress() const {
    return retry_.lost() ? std::optional(retry_.Progress()) : std::nullopt;
  }
  /// One line about the last loss: address, cause, where the stream continues, and the time since
  /// the loss.
  std::string LossDescription() const { return retry_.LossDescription(); }

  /// Ends a call. Receiver's thread only.
  void Drop(std::unique_ptr<StreamCall> call) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  /// Any thread. OpenAgain soon fails with CANCELLED.
  void Cancel() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

 private:
  class Calls;

  absl::StatusOr<Opened> OpenNewAt(TimePoint give_up_at, bool& retryable)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void Start(std::shared_ptr<grpc::Channel> channel) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  // For Clang's thread-safety analysis: the attempt uses the same monitor. Does nothing.
  void AssertAttemptLocked() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex)
      ABSL_ASSERT_EXCLUSIVE_LOCK(attempt_->mutex()) {}
  const std::string& address() const { return retry_.address(); }
  CallPurpose Purpose() const;

  Monitor& monitor_;
  const StreamOptions options_;
  RetryLoop retry_;

  std::unique_ptr<StreamCall> attempt_ ABSL_GUARDED_BY(monitor_.mutex);
  bool cancelled_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  v1::ResumeStream resume_;
  bool resuming_ = false;
};

}  // namespace partiemc::client
