// After a loss: at which address, when and for how long to try again. One for streams and watches.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/backoff.h"
#include "client/library/clock.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {

/// Who makes the attempts: opens calls, one at a time.
class Attempts {
 public:
  using TimePoint = Clock::TimePoint;

  virtual ~Attempts() = default;

  virtual bool Cancelled() = 0;
  /// Begins to open a call at `address`; waits for nothing. Errors end the loop.
  virtual absl::Status Start(const std::string& address) = 0;
  /// What has become of the attempt: true where the call is open, false where nothing is known yet.
  /// Errors end the loop, but for those that `retryable` is set for.
  virtual absl::StatusOr<bool> Check(bool& retryable) = 0;
  /// Gives the attempt up.
  virtual void Drop() = 0;
  /// Waits until then, or for news of the attempt or a Cancel.
  virtual void Wait(TimePoint until) = 0;
};

/// Not thread-safe.
class RetryLoop {
 public:
  using TimePoint = Clock::TimePoint;
  enum class Outcome { kOpened, kNotYet, kGaveUp, kCancelled };

  /// At least one address. `call` is what is opened, for messages: "stream", "watcher".
  RetryLoop(std::vector<std::string> addresses, const char* call, const ReconnectPolicy& policy,
            std::chrono::milliseconds connect_timeout, const TimeAndChance& surroundings = {});

  const std::vector<std::string>& addresses() const { return addresses_; }
  /// The one in use, or to be tried next.
  const std::string& address() const { return addresses_[address_]; }
  /// Addresses to try after those that were given, in place of others learned before; the one in
  /// use stays. Of many the first some.
  void Learn(const std::vector<std::string>& addresses);
  void UseNextAddress() { address_ = (address_ + 1) % addresses_.size(); }

  /// The call at address() is lost; `story` tells where and why. One that comes before Recovered
  /// prolongs the loss before it.
  void Lose(std::string story);
  /// The next attempt, after a pause, is at the next address, or at the same. `refusal`: what came
  /// of the last one.
  void TryNext(absl::Status refusal);
  void TryAgain(absl::Status refusal);
  /// The next loss is another one.
  void Recovered() { backoff_.reset(); }
  /// From Lose to Recovered.
  bool lost() const { return backoff_.has_value(); }

  /// Makes attempts until one has opened a call, nothing later than `until`. Requires lost().
  /// Errors: those of `attempts`.
  absl::StatusOr<Outcome> Run(Attempts& attempts, std::optional<TimePoint> until);

  /// Of the loss that is being mended. Requires lost().
  Reconnecting Progress() const;
  /// Of the last loss, recovered or not: that of Lose, and where it has gone on, in one line.
  std::string Story() const;
  /// Of the last attempt.
  const absl::Status& refusal() const { return refusal_; }

 private:
  TimePoint Now() const { return surroundings_.clock->Now(); }

  std::vector<std::string> addresses_;
  const std::size_t given_;  // Of them, at the front.
  const char* const call_;
  const ReconnectPolicy policy_;
  const std::chrono::milliseconds connect_timeout_;
  const TimeAndChance surroundings_;

  std::size_t address_ = 0;
  std::optional<Backoff> backoff_;  // From Lose to Recovered.
  TimePoint lost_at_, attempt_at_;
  std::string story_;
  std::optional<TimePoint> attempt_until_;  // While one is under way.
  absl::Status refusal_;
};

}  // namespace partiemc::client
