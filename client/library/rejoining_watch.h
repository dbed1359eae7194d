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
#include "client/library/retry_loop.h"
#include "client/library/watch_call.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {

/// Used by one thread, but for Cancel.
class RejoiningWatch final : public Watcher {
 public:
  using Clock = WatchCall::Clock;

  /// At least one address.
  RejoiningWatch(std::vector<std::string> addresses, std::string_view stream_name,
                 const WatcherOptions& options);

  /// As Watcher::Open; to be called first.
  absl::Status Connect();

  const WatchedStream& stream() const override { return stream_; }
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait) override;
  std::optional<Reconnecting> reconnecting() const override {
    return retry_.lost() && !joined_ ? std::optional(retry_.Progress()) : std::nullopt;
  }
  const WatchEnd& end() const override { return end_; }
  void Cancel() override;

 private:
  class Calls;

  absl::Status ConnectAt(std::chrono::milliseconds connect_timeout);
  absl::StatusOr<Received> ReceiveOrLose(WatchedFrame& frame,
                                         std::optional<std::chrono::milliseconds> wait);
  // The first frame that is asked for; none: the newest.
  std::optional<std::uint64_t> From() const;
  bool Lose(const absl::StatusOr<Received>& received);
  // kEvent once it goes on, kNothingYet if it does not yet; else it never will.
  absl::StatusOr<Received> Rejoin(std::optional<Clock::time_point> until);
  void Account(WatchedFrame& frame);
  void SetCall(std::shared_ptr<WatchCall> call);
  const std::string& address() const { return retry_.address(); }

  const std::string stream_name_;
  const WatcherOptions options_;

  WatchedStream stream_;
  std::string lineage_;
  WatchEnd end_;
  RetryLoop retry_;
  bool joined_ = false;                           // In `call_`; else it is an attempt, or nothing.
  std::optional<absl::StatusOr<Received>> lost_;  // What ended it; given if nothing comes of it.
  std::optional<absl::StatusOr<Received>> over_;  // Once nothing more will come.
  std::uint64_t last_ = 0;                        // Sequence number of the last frame; 0: none yet.
  std::uint64_t untold_ = 0;                      // Drops that ends of calls have told since.

  std::mutex mutex_;  // Guards everything below; `call_` changes in the receiver's thread alone.
  std::condition_variable cancel_came_;
  std::shared_ptr<WatchCall> call_;
  bool cancelled_ = false;
};

}  // namespace partiemc::client
