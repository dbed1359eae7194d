// A watch that survives the loss of its call: it looks for the stream at every address and
// continues with the frames it has not delivered.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/retry_loop.h"
#include "client/library/watch_call.h"
#include "common/clock.h"
#include "common/mutex.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {

/// Used by one thread, except Cancel.
class RejoiningWatch final : public Watcher {
 public:
  using TimePoint = Clock::TimePoint;

  /// Requires: at least one address.
  RejoiningWatch(std::vector<std::string> addresses, std::string_view stream_name,
                 const WatcherOptions& options, const TimeAndChance& surroundings = {});

  /// Same as Watcher::Open. Must be called first.
  absl::Status Connect();

  const WatchedStream& stream() const override { return stream_; }
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait) override;
  std::optional<Reconnecting> reconnecting() const override {
    return retry_.lost() && !joined_ ? std::optional(retry_.Progress()) : std::nullopt;
  }
  const WatchEnd& end() const override { return end_; }
  void Cancel() override ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  class Calls;

  absl::Status ConnectAt(std::chrono::milliseconds connect_timeout);
  absl::StatusOr<Received> ReceiveOrLose(WatchedFrame& frame,
                                         std::optional<std::chrono::milliseconds> wait);
  // The first sequence number to request from a server; absent: the newest frame.
  std::optional<std::uint64_t> From() const;
  bool Lose(const absl::StatusOr<Received>& received);
  // Continues to rejoin. Returns kEvent if the watch has rejoined, kNothingYet if it has not
  // rejoined by `until`. After WatcherOptions::rejoin.give_up_after, returns the end or the error
  // of the lost call. kEnd and errors end the watch.
  absl::StatusOr<Received> Rejoin(std::optional<TimePoint> until);
  void Account(WatchedFrame& frame);
  void SetCall(std::shared_ptr<WatchCall> call) ABSL_LOCKS_EXCLUDED(mutex_);
  const std::string& address() const { return retry_.address(); }

  const std::string stream_name_;
  const WatcherOptions options_;
  const Clock& clock_;

  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  RetryLoop retry_;
  std::shared_ptr<WatchCall> call_;
  bool joined_ = false;  // True if `call_` is the current watch, false if it is an attempt or null.
  std::optional<absl::StatusOr<Received>>
      lost_;  // Status of the lost call; returned if the watch gives up.
  std::optional<absl::StatusOr<Received>> over_;  // Set when the watch has ended.
  std::uint64_t last_ = 0;                        // Number of the last delivered frame; 0: none.
  std::uint64_t unreported_drops_ = 0;  // Dropped frames of ended calls, not yet reported.

  Mutex mutex_;
  CondVar cancel_came_;
  std::shared_ptr<WatchCall> shared_call_ ABSL_GUARDED_BY(mutex_);  // call_, for Cancel.
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace partiemc::client
