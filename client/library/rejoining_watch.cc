#include "library/rejoining_watch.h"

#include <algorithm>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "library/channel.h"

namespace partiemc::client {
RejoiningWatch::RejoiningWatch(std::vector<std::string> addresses, std::string_view stream_name,
                               const WatcherOptions& options)
    : addresses_(std::move(addresses)), stream_name_(stream_name), options_(options) {}

// The stream is at one of the servers; what one of them says is worth more than that there is none
// at an address.
absl::Status RejoiningWatch::Open() {
  const auto time = options_.connect_timeout / static_cast<int>(addresses_.size());
  absl::Status refusal;
  for (address_ = 0; address_ < addresses_.size(); ++address_) {
    absl::Status status = OpenAt(time);
    if (status.ok()) return status;
    SetCall(nullptr);
    if (refusal.ok() || absl::IsUnavailable(refusal)) refusal = std::move(status);
  }
  return refusal;
}

absl::Status RejoiningWatch::OpenAt(std::chrono::milliseconds connect_timeout) {
  const auto channel = MakeChannel(address(), options_.credentials);
  if (!channel.ok()) return channel.status();
  if (auto status = Connect(*channel, address(), connect_timeout); !status.ok()) return status;
  SetCall(std::make_shared<WatchCall>(*channel, address()));
  call_->Start(stream_name_, options_);
  const auto opened = call_->WaitUntilOpened(Clock::now() + options_.deadline);
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
  std::optional<Clock::time_point> until;
  if (wait) until = Clock::now() + *wait;
  for (;;) {
    if (!joined_) {
      const auto rejoined = Rejoin(until);
      if (!rejoined.ok() || *rejoined != Received::kEvent) return rejoined;
    }
    std::optional<std::chrono::milliseconds> left;
    if (until) {
      left = std::max(std::chrono::ceil<std::chrono::milliseconds>(*until - Clock::now()),
                      std::chrono::milliseconds(0));
    }
    auto received = call_->Receive(frame, left);
    if (received.ok() && *received == Received::kNothingYet) return received;
    if (received.ok() && *received == Received::kEvent) {
      if (frame.sequence <= last_) continue;  // Seen before the watch was lost.
      Account(frame);
      return received;
    }
    if (!Lose(received)) return received;
  }
}

// What lies between two calls nobody has counted: results that were dropped, or that came while
// nobody watched, and frames that were refused.
void RejoiningWatch::Account(WatchedFrame& frame) {
  frame.gap = 0;
  frame.rejoined.clear();
  if (loss_) {
    frame.rejoined = absl::StrCat(loss_->story, ", went on at ", address(), " after ",
                                  Seconds(Clock::now() - loss_->at));
    if (last_ == 0) {
      frame.dropped += untold_;
    } else {
      frame.gap = frame.sequence - last_ - 1;
      frame.dropped = 0;
    }
    loss_.reset();
    untold_ = 0;
  }
  last_ = frame.sequence;
}

// Whether there is any sense in looking for the stream.
bool RejoiningWatch::Lose(const absl::StatusOr<Received>& received) {
  end_ = call_->end();
  end_.dropped += untold_;
  if (options_.rejoin.give_up_after.count() <= 0 || lineage_.empty() || !call_->lost()) {
    return false;
  }
  untold_ = end_.dropped;
  joined_ = false;
  const auto now = Clock::now();
  if (!loss_) {
    loss_.emplace(
        Loss{.backoff = Backoff(options_.rejoin, addresses_.size(), std::random_device{}()),
             .at = now,
             .attempt_at = now,
             .received = received,
             .story = absl::StrCat("lost the stream at ", address(), " (", call_->why(), ")")});
  }
  // A producer that is gone from a server that is there may come back to it.
  if (!end_.reason.empty() && received.ok()) address_ += addresses_.size() - 1;
  TryNext(received.status());
  return true;
}

void RejoiningWatch::TryNext(const absl::Status& refusal) {
  SetCall(nullptr);
  refusal_ = refusal;
  address_ = (address_ + 1) % addresses_.size();
  loss_->attempt_at = Clock::now() + loss_->backoff.NextPause();
}

absl::StatusOr<Received> RejoiningWatch::Rejoin(std::optional<Clock::time_point> until) {
  const auto give_up_at = loss_->at + options_.rejoin.give_up_after;
  for (;;) {
    if (Cancelled()) return absl::CancelledError("the watch was cancelled");
    const auto now = Clock::now();
    if (call_ != nullptr) {
      const auto next = std::min(loss_->attempt_until, until.value_or(loss_->attempt_until));
      const auto joined = TryAttempt(next);
      if (!joined.ok()) return joined.status();
      if (*joined) return Received::kEvent;
    } else if (now >= give_up_at) {
      const absl::Status& lost = loss_->received.status();
      if (lost.ok()) return loss_->received;
      return absl::Status(lost.code(), absl::StrCat(lost.message(), "; not found again within ",
                                                    Seconds(options_.rejoin.give_up_after), ": ",
                                                    refusal_.message()));
    } else if (now >= loss_->attempt_at) {
      if (auto status = StartAttempt(); !status.ok()) return status;
      loss_->attempt_until = std::min(now + options_.connect_timeout, give_up_at);
      continue;
    } else {
      const auto next = std::min(loss_->attempt_at, give_up_at);
      std::unique_lock lock(mutex_);
      cancel_came_.wait_until(lock, until ? std::min(next, *until) : next,
                              [this] { return cancelled_; });
    }
    if (until && Clock::now() >= *until) return Received::kNothingYet;
  }
}

// True if it has come to something, false if it has not, or has ended: then another one is due.
absl::StatusOr<bool> RejoiningWatch::TryAttempt(Clock::time_point until) {
  const auto opened = call_->WaitUntilOpened(until);
  if (opened.ok() && *opened) {
    if (call_->lineage() == lineage_) {
      stream_ = call_->stream();
      joined_ = true;
      return true;
    }
    TryNext(absl::NotFoundError(
        absl::StrCat("the server at ", address(), " has another stream of this name")));
  } else if (!opened.ok()) {
    const std::string reason = call_->reason();
    // The producer may not have come back yet, the place of the former call not be free.
    const bool passes = reason == "NO_SUCH_STREAM" || reason == "TOO_MANY_WATCHERS" ||
                        reason == "TOO_MANY_OPENING" || reason == "CALLER_WATCHERS" ||
                        reason == "CALLER_CALLS";
    if (!passes && !call_->lost()) return opened.status();
    TryNext(opened.status());
  } else if (Clock::now() >= loss_->attempt_until) {
    TryNext(NotAccepted(address(), "watcher", options_.connect_timeout));
  }
  return false;
}

absl::Status RejoiningWatch::StartAttempt() {
  const auto channel = MakeChannel(address(), options_.credentials);
  if (!channel.ok()) return channel.status();
  SetCall(std::make_shared<WatchCall>(*channel, address()));
  call_->Start(stream_name_, options_);
  return absl::OkStatus();
}

void RejoiningWatch::SetCall(std::shared_ptr<WatchCall> call) {
  std::unique_lock lock(mutex_);
  std::swap(call, call_);
  if (cancelled_ && call_ != nullptr) call_->Cancel();
  lock.unlock();  // The former one ends without it.
}

bool RejoiningWatch::Cancelled() {
  const std::lock_guard lock(mutex_);
  return cancelled_;
}

void RejoiningWatch::Cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  cancel_came_.notify_all();
  if (call_ != nullptr) call_->Cancel();
}

}  // namespace partiemc::client
