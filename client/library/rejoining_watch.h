// A watch that outlives its calls: where one is lost it looks for the stream, at every address, and
// goes on with what has not been seen.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "library/backoff.h"
#include "library/watch_call.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {

/// Used by one thread, but for Cancel.
class RejoiningWatch {
 public:
  using Clock = WatchCall::Clock;

  /// At least one address.
  RejoiningWatch(std::vector<std::string> addresses, std::string_view stream_name,
                 const WatcherOptions& options);

  /// Each as that of Watcher; to be called first.
  absl::Status Open();
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait);
  const WatchedStream& stream() const { return stream_; }
  const WatchEnd& end() const { return end_; }
  void Cancel();

 private:
  // A watch that is being looked for.
  struct Loss {
    Backoff backoff;
    Clock::time_point at, attempt_at, attempt_until = {};
    absl::StatusOr<Received> received;  // What ended it; given if nothing comes of it.
    std::string story;                  // Where it was lost, and why.
  };

  absl::Status OpenAt(std::chrono::milliseconds connect_timeout);
  absl::StatusOr<Received> ReceiveOrLose(WatchedFrame& frame,
                                         std::optional<std::chrono::milliseconds> wait);
  bool Lose(const absl::StatusOr<Received>& received);
  // kEvent once it goes on, kNothingYet if it does not yet; else it never will.
  absl::StatusOr<Received> Rejoin(std::optional<Clock::time_point> until);
  absl::StatusOr<bool> TryAttempt(Clock::time_point until);
  absl::Status StartAttempt();
  void TryNext(const absl::Status& refusal);
  void Account(WatchedFrame& frame);
  void SetCall(std::shared_ptr<WatchCall> call);
  bool Cancelled();
  const std::string& address() const { return addresses_[address_]; }

  const std::vector<std::string> addresses_;
  const std::string stream_name_;
  const WatcherOptions options_;

  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  std::size_t address_ = 0;                       // The one in use, or to be tried next.
  bool joined_ = false;                           // In `call_`; else it is an attempt, or nothing.
  std::optional<Loss> loss_;                      // Until the next new frame.
  absl::Status refusal_;                          // Of the last attempt.
  std::optional<absl::StatusOr<Received>> over_;  // Once nothing more will come.
  std::uint64_t last_ = 0;                        // Sequence number of the last frame; 0: none yet.
  std::uint64_t untold_ = 0;                      // Drops that ends of calls have told since.

  std::mutex mutex_;  // Guards everything below; `call_` changes in the receiver's thread alone.
  std::condition_variable cancel_came_;
  std::shared_ptr<WatchCall> call_;
  bool cancelled_ = false;
};

}  // namespace partiemc::client
