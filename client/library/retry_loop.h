// Schedules attempts after a loss: address, pause and time limit. Used by streams and watches.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/backoff.h"
#include "common/clock.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {

/// Makes attempts for a RetryLoop: opens calls, one at a time.
class Attempts {
 public:
  using TimePoint = Clock::TimePoint;

  virtual ~Attempts() = default;

  virtual bool Cancelled() = 0;
  /// Starts to open a call at `address` without waiting. Errors end the loop.
  virtual absl::Status Start(const std::string& address) = 0;
  /// State of the attempt: true if the call is open, false if it is pending. An error ends the loop
  /// unless `retryable` is set.
  virtual absl::StatusOr<bool> Check(bool& retryable) = 0;
  /// Abandons the attempt.
  virtual void Drop() = 0;
  /// Waits until `until`, a change of the attempt, or Cancel.
  virtual void Wait(TimePoint until) = 0;
};

/// Not thread-safe.
class RetryLoop {
 public:
  using TimePoint = Clock::TimePoint;
  enum class Outcome { kOpened, kNotYet, kGaveUp, kCancelled };

  /// Requires: at least one address. `call` is "stream" or "watcher", for messages.
  RetryLoop(std::vector<std::string> addresses, const char* call, const ReconnectPolicy& policy,
            std::chrono::milliseconds connect_timeout, const TimeAndChance& surroundings = {});

  const std::vector<std::string>& addresses() const { return addresses_; }
  /// The address in use, or the next one to try.
  const std::string& address() const { return addresses_[address_]; }
  /// Replaces the addresses that were learned before. The addresses passed to the constructor and
  /// the address in use stay. At most 16 learned addresses are kept.
  void Learn(const std::vector<std::string>& addresses);
  void UseNextAddress() { address_ = (address_ + 1) % addresses_.size(); }

  /// Records the loss of the call at address(), with a description. Until Recovered, further losses
  /// count as part of this one: its description and its start do not change.
  void Lose(std::string description);
  /// Schedules the next attempt, after a pause: TryNext at the next address, TryAgain at the same.
  /// `refusal` is the error of the last attempt.
  void TryNext(absl::Status refusal);
  void TryAgain(absl::Status refusal);
  /// Ends the loss.
  void Recovered() { backoff_.reset(); }
  /// From Lose to Recovered.
  bool lost() const { return backoff_.has_value(); }

  /// Makes attempts until one has opened a call. Returns kNotYet at `until`, kGaveUp when
  /// ReconnectPolicy::give_up_after has passed. Requires lost(). Errors: from `attempts`.
  absl::StatusOr<Outcome> Run(Attempts& attempts, std::optional<TimePoint> until);

  /// Requires lost().
  Reconnecting Progress() const;
  /// One line about the last loss: the description passed to Lose, the address where the call
  /// continues, and the time since the loss.
  std::string LossDescription() const;
  /// The error of the last attempt since Lose. If it has no Violation, also the last error with
  /// one, which is usually the answer of another server. Empty before the first attempt has failed.
  std::string RefusalText() const;

 private:
  TimePoint Now() const { return surroundings_.clock->Now(); }

  std::vector<std::string> addresses_;
  const std::size_t given_;  // Number of given addresses, at the front.
  const char* const call_;
  const ReconnectPolicy policy_;
  const std::chrono::milliseconds connect_timeout_;
  const TimeAndChance surroundings_;

  std::size_t address_ = 0;
  std::optional<Backoff> backoff_;  // Set from Lose to Recovered.
  TimePoint lost_at_, attempt_at_;
  std::string loss_;
  std::optional<TimePoint> attempt_until_;  // Set while an attempt is in progress.
  // The last errors: of any attempt, and with a Violation.
  absl::Status refusal_, answer_;
};

}  // namespace partiemc::client
