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
#include "library/backoff.h"
#include "library/loss.h"
#include "library/stream_call.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {

/// Used by the receiver's thread alone, but for Cancel. Members with a `lock` expect the monitor's
/// to be held and let it go meanwhile.
class CallOpener {
 public:
  using Clock = StreamCall::Clock;
  using Lock = StreamCall::Lock;

  struct Opened {
    std::unique_ptr<StreamCall> call;
    v1::StreamOpened message;
  };

  /// `monitor` outlives it. At least one address.
  CallOpener(Monitor& monitor, std::vector<std::string> addresses, const StreamOptions& options);

  /// Opens a new stream at the first address where that works.
  /// Errors: those of Stream::Open.
  absl::StatusOr<Opened> OpenNew(Lock& lock);

  /// The stream has lost its call by `loss`: from now on OpenAgain is about that. A loss
  /// that comes before Mended prolongs the one before it.
  void Lost(const Loss& loss, v1::ResumeStream resume);
  /// Goes on with what is to be done about a loss: waits, connects, opens. Nothing when it is not
  /// through at `until`. Errors: what the server refuses the stream for; UNAVAILABLE when
  /// ReconnectPolicy::give_up_after is over.
  absl::StatusOr<std::optional<Opened>> OpenAgain(Lock& lock,
                                                  std::optional<Clock::time_point> until);
  /// The stream has got on: the next loss is another one.
  void Mended() { backoff_.reset(); }

  /// Where and why the stream was lost, and where it has gone on, in one line.
  std::string Story() const;

  /// Ends a call. Of the receiver's thread.
  static void Drop(Lock& lock, std::unique_ptr<StreamCall> call);

  /// Any thread: OpenAgain fails soon with CANCELLED.
  void Cancel(Lock& lock);

 private:
  absl::StatusOr<Opened> OpenNewAt(Lock& lock, Clock::time_point give_up_at, bool& mendable);
  void Start(Lock& lock, std::shared_ptr<grpc::Channel> channel);
  void TryNext(absl::Status refusal);
  const std::string& address() const { return addresses_[address_]; }

  Monitor& monitor_;
  const std::vector<std::string> addresses_;
  const StreamOptions options_;

  std::size_t address_ = 0;              // The one in use, or to be tried next.
  std::unique_ptr<StreamCall> attempt_;  // Guarded by the monitor.
  bool cancelled_ = false;               // Guarded by the monitor.
  v1::ResumeStream resume_;
  bool resuming_ = false;
  std::optional<Backoff> backoff_;  // From Lost to Mended; so are those below.
  Clock::time_point lost_at_, attempt_at_, attempt_until_;
  std::string lost_;      // Where and why.
  absl::Status refusal_;  // Of the last attempt.
};

}  // namespace partiemc::client
