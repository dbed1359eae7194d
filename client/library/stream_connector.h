// Finds a server for a stream: which address, when, and for how long.
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

/// Used by the receiver's thread alone, but for Cancel. Members with a `lock` expect the monitor's
/// to be held and let it go meanwhile.
class StreamConnector {
 public:
  using Clock = StreamCall::Clock;
  using Lock = StreamCall::Lock;

  struct Opened {
    std::unique_ptr<StreamCall> call;
    v1::StreamOpened message;
  };

  /// `monitor` outlives it. At least one address.
  StreamConnector(Monitor& monitor, std::vector<std::string> addresses,
                  const StreamOptions& options);

  /// Opens a new stream at the first address where that works.
  /// Errors: those of Stream::Open.
  absl::StatusOr<Opened> OpenNew(Lock& lock);

  /// Addresses that a server knows, for when the stream is lost: those that the credentials suit.
  void Learn(const v1::StreamNotice& notice);
  /// The stream has lost its call by `loss`: from now on OpenAgain is about that. A loss
  /// that comes before Recovered prolongs the one before it.
  void Lost(const Loss& loss, v1::ResumeStream resume);
  /// Goes on with what is to be done about a loss: waits, connects, opens. Nothing when it is not
  /// through at `until`. Errors: what the server refuses the stream for; UNAVAILABLE when
  /// ReconnectPolicy::give_up_after is over.
  absl::StatusOr<std::optional<Opened>> OpenAgain(Lock& lock,
                                                  std::optional<Clock::time_point> until);
  /// The stream has got on: the next loss is another one.
  void Recovered() { retry_.Recovered(); }

  /// Absent unless a loss is being mended.
  std::optional<Reconnecting> Progress() const {
    return retry_.lost() ? std::optional(retry_.Progress()) : std::nullopt;
  }
  /// Where and why the stream was lost, and where it has gone on, in one line.
  std::string Story() const { return retry_.Story(); }

  /// Ends a call. Of the receiver's thread.
  static void Drop(Lock& lock, std::unique_ptr<StreamCall> call);

  /// Any thread: OpenAgain fails soon with CANCELLED.
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
