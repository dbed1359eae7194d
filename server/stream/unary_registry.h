// The calls of one request and one answer that are going on: how many may come in, and how all are
// sent home.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "server/compute/fair_share.h"
#include "server/security/caller.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a call too many (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyCalls = "TOO_MANY_CALLS";

/// Safe from any thread.
class UnaryRegistry {
 public:
  /// What one caller may have of calls that ask for information alone: they take next to no time.
  static constexpr std::uint32_t kInformationCalls = 64;

  /// For one caller. There are twice as many places of each kind, and a caller has no more of them
  /// than are free (FairShare).
  explicit UnaryRegistry(std::uint32_t max_frame_calls)
      : places_{FairShare(2 * std::uint64_t{max_frame_calls}), FairShare(2 * kInformationCalls),
                FairShare(2 * kInformationCalls)} {}

  /// A call comes in, without a request yet: those are counted elsewhere (OpeningCalls). Errors,
  /// each with a Violation: UNAVAILABLE (DRAINING), for frames only.
  absl::Status Enter(std::shared_ptr<UnaryStateMachine> call, UnaryKind kind);
  /// Its request has come, and it gets a place; the account lives until it gives that back.
  /// Errors, each with a Violation: RESOURCE_EXHAUSTED (TOO_MANY_CALLS).
  absl::Status TakePlace(const UnaryStateMachine& call, const CallerAccount& caller);
  /// It has its last word, and its place is free for others. It may have had none.
  void GiveBackPlace(const UnaryStateMachine& call);
  /// The connection has taken its last word.
  void Leave(const UnaryStateMachine& call);

  /// Of all kinds.
  std::size_t count() const;

  /// Ends those that have waited for their clients for too long. Gives the time before which none
  /// of those that are here now will have.
  std::chrono::steady_clock::time_point EndIdle(const UnaryLimits& limits,
                                                std::chrono::steady_clock::time_point now);

  /// Lets no frame in any more and ends the calls whose request has not come.
  void Drain();
  /// Whether all that have frames have left before the deadline. Calls for information may go on.
  bool WaitForFrames(std::chrono::steady_clock::time_point deadline);

 private:
  struct Entry {
    std::shared_ptr<UnaryStateMachine> call;
    UnaryKind kind;
    const CallerAccount* caller = nullptr;  // Whose place it has; null: none yet.
  };

  std::vector<std::shared_ptr<UnaryStateMachine>> All() const;
  void FreePlace(const UnaryStateMachine& call);  // With the lock held.

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<const UnaryStateMachine*, Entry> calls_;
  std::array<FairShare, 3> places_;  // By kind.
  bool draining_ = false;
};

}  // namespace partiemc::server
