// Finds a server for a stream: address, time and time limit of each attempt.
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

/// Used by the receiver's thread only, except Cancel. Members with a `lock` require the monitor's
/// lock and release it while they wait.
class StreamConnector {
 public:
  using Clock = StreamCall::Clock;
  using Lock = StreamCall::Lock;

  struct Opened {
    std::unique_ptr<StreamCall> call;
    v1::StreamOpened message;
  };

  /// `monitor` must outlive this object. Requires: at least one address.
  StreamConnector(Monitor& monitor, std::vector<std::string> addresses,
                  const StreamOptions& options);

  /// Opens a new stream at the first address that accepts it. Errors: see Stream::Open.
  absl::StatusOr<Opened> OpenNew(Lock& lock);

  /// Adds addresses from a server's notice for failover, if the credentials suit them.
  void Learn(const v1::StreamNotice& notice);
  /// Records that the stream lost its call; OpenAgain then resumes it with `resume`. A loss before
  /// Recovered extends the previous one.
  void Lost(const Loss& loss, v1::ResumeStream resume);
  /// Continues to reconnect: waits, connects, opens. Returns nothing if no call is open at `until`.
  /// Errors: the server's refusal; UNAVAILABLE after ReconnectPolicy::give_up_after.
  absl::StatusOr<std::optional<Opened>> OpenAgain(Lock& lock,
                                                  std::optional<Clock::time_point> until);
  /// Ends the loss: a new result was delivered.
  void Recovered() { retry_.Recovered(); }

  /// Absent unless the stream reconnects.
  std::optional<Reconnecting> Progress() const {
    return retry_.lost() ? std::optional(retry_.Progress()) : std::nullopt;
  }
  /// One line about the last loss: address, cause and where the stream continues.
  std::string LossDescription() const { return retry_.LossDescription(); }

  /// Ends a call. Receiver's thread only.
  static void Drop(Lock& lock, std::unique_ptr<StreamCall> call);

  /// Any thread. OpenAgain soon fails with CANCELLED.
  void Cancel(Lock& lock);

 private:
  class Calls;

  absl::StatusOr<Opened> OpenNewAt(Lock& lock, Clock::time_point give_up_at, bool& retryable);
  void Start(Lock& lock, std::shared_ptr<grpc::Channel> channel);
  const std::string& address() const { return retry_.address(); }
  CallPurpose Purpose() const;

  Monitor& monitor_;
  const StreamOptions options_;
  RetryLoop retry_;

  std::unique_ptr<StreamCall> attempt_;  // Guarded by the monitor.
  bool cancelled_ = false;               // Guarded by the monitor.
  v1::ResumeStream resume_;
  bool resuming_ = false;
};

}  // namespace partiemc::client
