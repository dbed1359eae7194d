#include "client/library/retry_loop.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

constexpr std::size_t kMaxLearned = 16;

}  // namespace

RetryLoop::RetryLoop(std::vector<std::string> addresses, const char* call,
                     const ReconnectPolicy& policy, std::chrono::milliseconds connect_timeout,
                     const TimeAndChance& surroundings)
    : addresses_(std::move(addresses)),
      given_(addresses_.size()),
      call_(call),
      policy_(policy),
      connect_timeout_(connect_timeout),
      surroundings_(surroundings) {}

void RetryLoop::Learn(const std::vector<std::string>& addresses) {
  const std::string current = address();
  addresses_.resize(given_);
  const auto add = [this](const std::string& one) {
    const bool is_known = std::ranges::find(addresses_, one) != addresses_.end();
    if (!is_known && addresses_.size() < given_ + kMaxLearned) addresses_.push_back(one);
  };
  add(current);
  for (const std::string& one : addresses) add(one);
  address_ = static_cast<std::size_t>(std::ranges::find(addresses_, current) - addresses_.begin());
}

void RetryLoop::Lose(std::string description) {
  if (backoff_) return;
  backoff_.emplace(policy_, addresses_.size(), surroundings_.random->Next());
  lost_at_ = attempt_at_ = Now();
  loss_ = std::move(description);
  refusal_ = answer_ = absl::OkStatus();
}

void RetryLoop::TryNext(absl::Status refusal) {
  UseNextAddress();
  TryAgain(std::move(refusal));
}

void RetryLoop::TryAgain(absl::Status refusal) {
  refusal_ = std::move(refusal);
  if (FindViolation(refusal_)) answer_ = refusal_;
  attempt_at_ = Now() + backoff_->NextPause();
}

absl::StatusOr<RetryLoop::Outcome> RetryLoop::Run(Attempts& attempts,
                                                  std::optional<TimePoint> until) {
  const auto give_up_at = lost_at_ + policy_.give_up_after;
  for (;;) {
    if (attempts.Cancelled()) return Outcome::kCancelled;
    const auto now = Now();
    if (attempt_until_) {
      bool retryable = false;
      auto opened = attempts.Check(retryable);
      if (!opened.ok() || *opened) {
        attempt_until_.reset();
        if (opened.ok()) return Outcome::kOpened;
        attempts.Drop();
        if (!retryable) return opened.status();
        TryNext(opened.status());
        continue;
      }
      if (now >= *attempt_until_) {
        attempts.Drop();
        // If give_up_at cut the attempt short, its timeout does not show that the server is slow.
        // The earlier error stays.
        if (*attempt_until_ < give_up_at) TryNext(NotAccepted(address(), call_, connect_timeout_));
        attempt_until_.reset();
        continue;
      }
    } else if (now >= give_up_at) {
      return Outcome::kGaveUp;
    } else if (now >= attempt_at_) {
      if (auto started = attempts.Start(address()); !started.ok()) return started;
      attempt_until_ = std::min(now + connect_timeout_, give_up_at);
      continue;
    }
    if (until && now >= *until) return Outcome::kNotYet;
    const auto next = attempt_until_ ? *attempt_until_ : std::min(attempt_at_, give_up_at);
    attempts.Wait(until ? std::min(next, *until) : next);
  }
}

std::string RetryLoop::RefusalText() const {
  std::string text(refusal_.message());
  if (answer_.ok() || answer_ == refusal_) return text;
  return absl::StrCat(text, "; before: ", answer_.message());
}

Reconnecting RetryLoop::Progress() const {
  return {.loss = loss_,
          .refusal = RefusalText(),
          .elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(Now() - lost_at_),
          .give_up_after = policy_.give_up_after};
}

std::string RetryLoop::LossDescription() const {
  return absl::StrCat(loss_, ", continued at ", address(), " after ", Seconds(Now() - lost_at_));
}

}  // namespace partiemc::client
