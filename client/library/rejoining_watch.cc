#include "client/library/rejoining_watch.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"

namespace partiemc::client {

// Attempts to rejoin the lost stream.
class RejoiningWatch::Calls final : public Attempts {
 public:
  explicit Calls(RejoiningWatch& watch) : watch_(watch) {}

  bool Cancelled() override {
    const MutexLock lock(watch_.mutex_);
    return watch_.cancelled_;
  }

  absl::Status Start(const std::string& address) override {
    const auto channel = MakeChannel(address, watch_.options_.credentials);
    if (!channel.ok()) return channel.status();
    watch_.SetCall(std::make_shared<WatchCall>(*channel, address, watch_.clock_));
    watch_.call_->Start(watch_.stream_name_, watch_.options_, watch_.From(), watch_.lineage_);
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Check(bool& retryable) override {
    WatchCall& call = *watch_.call_;
    const auto opened =
        news_ ? *std::exchange(news_, {}) : call.WaitUntilOpened(watch_.clock_.Now());
    if (!opened.ok()) {
      const std::string reason = call.reason();
      // These refusals can change: the producer may still be reconnecting, and the lost call may
      // still hold its slot.
      retryable = reason == "NO_SUCH_STREAM" || reason == "TOO_MANY_WATCHERS" ||
                  reason == "TOO_MANY_OPENING" || reason == "TOO_MANY_CONNECTIONS" ||
                  reason == "CALLER_WATCHERS" || reason == "CALLER_CALLS" || call.lost();
      return opened;
    }
    if (!*opened || call.lineage() == watch_.lineage_) return opened;
    retryable = true;
    return absl::NotFoundError(
        absl::StrCat("the server at ", call.address(), " has another stream of this name"));
  }

  void Drop() override { watch_.SetCall(nullptr); }

  void Wait(TimePoint until) override {
    if (watch_.call_ != nullptr) {
      news_ = watch_.call_->WaitUntilOpened(until);
    } else {
      const MutexLock lock(watch_.mutex_);
      while (!watch_.cancelled_ &&
             watch_.clock_.WaitUntil(watch_.cancel_came_, watch_.mutex_, until)) {
      }
    }
  }

 private:
  RejoiningWatch& watch_;
  std::optional<absl::StatusOr<bool>> news_;  // Result of the last Wait.
};

absl::StatusOr<std::unique_ptr<Watcher>> Watcher::Open(std::string_view address,
                                                       std::string_view stream_name,
                                                       const WatcherOptions& options) {
  std::vector<std::string> addresses = {std::string(address)};
  addresses.insert(addresses.end(), options.fallback_addresses.begin(),
                   options.fallback_addresses.end());
  auto watch = std::make_unique<RejoiningWatch>(std::move(addresses), stream_name, options);
  if (auto status = watch->Connect(); !status.ok()) return status;
  return watch;
}

RejoiningWatch::RejoiningWatch(std::vector<std::string> addresses, std::string_view stream_name,
                               const WatcherOptions& options, const TimeAndChance& surroundings)
    : stream_name_(stream_name),
      options_(options),
      clock_(*surroundings.clock),
      retry_(std::move(addresses), "watcher", options.rejoin, options.connect_timeout,
             surroundings) {}

// Tries each address once. If all fail, returns the refusal of a server rather than the error of an
// address without a server, because the refusal is more informative.
absl::Status RejoiningWatch::Connect() {
  const std::size_t count = retry_.addresses().size();
  const auto time = options_.connect_timeout / static_cast<int>(count);
  absl::Status refusal;
  for (std::size_t k = 0; k < count; ++k, retry_.UseNextAddress()) {
    absl::Status status = ConnectAt(time);
    if (status.ok()) return status;
    SetCall(nullptr);
    if (refusal.ok() || absl::IsUnavailable(refusal)) refusal = std::move(status);
  }
  return refusal;
}

absl::Status RejoiningWatch::ConnectAt(std::chrono::milliseconds connect_timeout) {
  const auto channel = MakeChannel(address(), options_.credentials);
  if (!channel.ok()) return channel.status();
  if (auto status = client::Connect(*channel, address(), connect_timeout); !status.ok())
    return status;
  SetCall(std::make_shared<WatchCall>(*channel, address(), clock_));
  call_->Start(stream_name_, options_, From());
  const auto opened = call_->WaitUntilOpened(clock_.Now() + options_.deadline);
  if (!opened.ok()) return opened.status();
  if (!*opened) return NotAccepted(address(), "watcher", options_.deadline);
  stream_ = call_->stream();
  lineage_ = call_->lineage();
  joined_ = true;
  return absl::OkStatus();
}

absl::StatusOr<Received> RejoiningWatch::Receive(WatchedFrame& frame,
                                                 std::optional<std::chrono::milliseconds> wait) {
  if (over_) return *over_;
  auto received = ReceiveOrLose(frame, wait);
  if (!received.ok() || *received == Received::kEnd) over_ = received;
  return received;
}

absl::StatusOr<Received> RejoiningWatch::ReceiveOrLose(
    WatchedFrame& frame, std::optional<std::chrono::milliseconds> wait) {
  std::optional<TimePoint> until;
  if (wait) until = clock_.Now() + *wait;
  for (;;) {
    if (!joined_) {
      const auto rejoined = Rejoin(until);
      if (!rejoined.ok() || *rejoined != Received::kEvent) return rejoined;
    }
    std::optional<std::chrono::milliseconds> left;
    if (until) {
      left = std::max(std::chrono::ceil<std::chrono::milliseconds>(*until - clock_.Now()),
                      std::chrono::milliseconds(0));
    }
    auto received = call_->Receive(frame, left);
    if (received.ok() && *received == Received::kNothingYet) return received;
    if (received.ok() && *received == Received::kEvent) {
      if (frame.sequence <= last_) continue;  // Delivered before the loss.
      Account(frame);
      return received;
    }
    if (!Lose(received)) return received;
  }
}

std::optional<std::uint64_t> RejoiningWatch::From() const {
  if (last_ == 0) return options_.from_sequence;
  // A watcher of the newest frames does not need the frames that it missed.
  const bool goes_on = options_.mode == WatchMode::kEvery || options_.from_sequence;
  return goes_on ? std::optional(last_ + 1) : std::nullopt;
}

// Sets `rejoined`, `gap` and `dropped` of `frame`, and ends a loss. Across a loss the client cannot
// distinguish dropped results, results that were computed during the loss, and refused frames.
// `gap` therefore counts all missing sequence numbers.
void RejoiningWatch::Account(WatchedFrame& frame) {
  frame.gap = 0;
  frame.rejoined.clear();
  if (retry_.lost()) {
    frame.rejoined = retry_.LossDescription();
    if (last_ == 0) {
      frame.dropped += unreported_drops_;
    } else {
      frame.gap = frame.sequence - last_ - 1;
      frame.dropped = 0;
    }
    retry_.Recovered();
    unreported_drops_ = 0;
  }
  last_ = frame.sequence;
}

// Records the loss of the call. Returns false if the watch does not rejoin: rejoining is disabled,
// the server does not support it (no lineage), or a retry cannot succeed.
bool RejoiningWatch::Lose(const absl::StatusOr<Received>& received) {
  end_ = call_->end();
  if (retry_.lost() && last_ != 0) {
    // No frame came since the watch was lost, so all after `last_` are missing. The counts of both
    // calls may contain the same frames.
    const std::uint64_t newest = stream_.held ? stream_.held->newest_sequence : 0;
    end_.dropped = std::max({end_.dropped, unreported_drops_, newest - std::min(newest, last_)});
  } else {
    end_.dropped += unreported_drops_;
  }
  if (options_.rejoin.give_up_after.count() <= 0 || lineage_.empty() || !call_->lost()) {
    return false;
  }
  unreported_drops_ = end_.dropped;
  joined_ = false;
  if (!retry_.lost()) lost_ = received;
  retry_.Lose(absl::StrCat("lost the stream at ", address(), " (", call_->why(), ")"));
  SetCall(nullptr);
  // If the producer was lost but not the server, the next attempt uses the same address: the
  // producer may return to it.
  if (!end_.reason.empty() && received.ok()) {
    retry_.TryAgain(received.status());
  } else {
    retry_.TryNext(received.status());
  }
  return true;
}

absl::StatusOr<Received> RejoiningWatch::Rejoin(std::optional<TimePoint> until) {
  Calls calls(*this);
  const auto outcome = retry_.Run(calls, until);
  if (!outcome.ok()) return outcome.status();
  switch (*outcome) {
    case RetryLoop::Outcome::kOpened:
      stream_ = call_->stream();
      joined_ = true;
      return Received::kEvent;
    case RetryLoop::Outcome::kNotYet:
      return Received::kNothingYet;
    case RetryLoop::Outcome::kCancelled:
      return absl::CancelledError("the watch was cancelled");
    case RetryLoop::Outcome::kGaveUp:
      break;
  }
  const absl::Status& lost = lost_->status();
  if (lost.ok()) return *lost_;
  return absl::Status(lost.code(), absl::StrCat(lost.message(), "; not found again within ",
                                                Seconds(options_.rejoin.give_up_after), ": ",
                                                retry_.RefusalText()));
}

void RejoiningWatch::SetCall(std::shared_ptr<WatchCall> call) {
  {
    const MutexLock lock(mutex_);
    shared_call_ = call;
    if (cancelled_ && call != nullptr) call->Cancel();
  }
  call_ = std::move(call);  // Destroys the former call, without the lock.
}

void RejoiningWatch::Cancel() {
  const MutexLock lock(mutex_);
  cancelled_ = true;
  cancel_came_.NotifyAll();
  if (shared_call_ != nullptr) shared_call_->Cancel();
}

}  // namespace partiemc::client
