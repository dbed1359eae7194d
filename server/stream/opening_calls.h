// Tracks the calls whose next request may hold unbounded memory. gRPC reports a message's size only
// after the whole message has arrived.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The violation's reason if a call is evicted (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyOpening = "TOO_MANY_OPENING";

/// Limits the opening calls: calls that have not sent their first request. If one more begins than
/// the limit permits, an opening call is evicted: the oldest of the caller with the most opening
/// calls. If several callers have the most, it is the oldest of all their calls. So silent calls
/// cannot block other callers, and a call that sends its request at once is hardly ever evicted.
///
/// Also tracks watchers, because they may send another request at any time. WatchRegistry limits
/// their number; here they are evicted only if memory is exhausted. Thread-safe.
class OpeningCalls {
 public:
  /// Evicts the call: ends it with this status unless its first request has arrived. Called from
  /// any thread, and possibly after the call's Place was destroyed.
  using GiveWay = std::function<void(const absl::Status&)>;

 private:
  /// The calls of each caller, oldest first. Not thread-safe.
  class Lines {
   public:
    void Add(const CallerAccount* caller, std::uint64_t number, GiveWay give_way);
    /// Empty if the call was removed already.
    GiveWay Remove(const CallerAccount* caller, std::uint64_t number);
    /// Removes the oldest call of the caller with the most calls. Requires: not empty.
    GiveWay RemoveNext();
    /// Removes the older half, rounded up, of that caller's calls.
    std::vector<GiveWay> RemoveHalf();
    std::size_t count() const { return count_; }

   private:
    // The key is the call's number; numbers increase.
    using Line = std::map<std::uint64_t, GiveWay>;
    // Number of a caller's calls, and the negated number of its oldest call. The caller with the
    // highest rank loses a call first.
    using Rank = std::pair<std::size_t, std::int64_t>;

    static Rank RankOf(const Line& line);

    std::size_t count_ = 0;
    std::map<const CallerAccount*, Line> lines_;  // Non-empty lines only.
    std::map<Rank, const CallerAccount*> ranks_;
  };

 public:
  /// A tracked call. Destroyed when the call's next request has arrived or the call ends.
  class Place {
   public:
    Place() = default;
    Place(Place&& other) noexcept { *this = std::move(other); }
    Place& operator=(Place&& other) noexcept {
      std::swap(calls_, other.calls_);
      std::swap(lines_, other.lines_);
      std::swap(caller_, other.caller_);
      std::swap(number_, other.number_);
      return *this;
    }
    ~Place();

   private:
    friend class OpeningCalls;
    OpeningCalls* calls_ = nullptr;
    Lines* lines_ = nullptr;
    const CallerAccount* caller_ = nullptr;
    std::uint64_t number_ = 0;
  };

  /// `places`: maximum number of opening calls; 0 counts as 1.
  explicit OpeningCalls(std::size_t places) : places_(places) {}

  /// Tracks an opening call, and may evict another one. Requires: the calling thread holds no lock.
  /// The account and this object outlive the returned Place.
  Place Enter(const CallerAccount& caller, GiveWay give_way) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Tracks a watcher that may send another request from now on. Evicts none.
  Place EnterWatcher(const CallerAccount& caller, GiveWay give_way) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Memory is exhausted: evicts the older half (at least one) of the opening calls of the caller
  /// with the most opening calls. Requires: the calling thread holds no lock.
  void GiveWayToAll() ABSL_LOCKS_EXCLUDED(mutex_);
  /// As GiveWayToAll, for watchers.
  void WatchersGiveWay() ABSL_LOCKS_EXCLUDED(mutex_);

  /// Blocks until a call is tracked or `also` returns true; then returns true. Returns false after
  /// StopWaiting. Used by one thread.
  bool WaitForOne(const std::function<bool()>& also = [] { return false; })
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// WaitForOne calls `also` again.
  void LookAgain() ABSL_LOCKS_EXCLUDED(mutex_);
  void StopWaiting() ABSL_LOCKS_EXCLUDED(mutex_);

  /// Number of opening calls; watchers do not count.
  std::size_t count() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  Place Take(Lines& lines, const CallerAccount& caller, GiveWay give_way)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::size_t places_;
  mutable Mutex mutex_;
  CondVar one_came_;
  bool waits_for_one_ ABSL_GUARDED_BY(mutex_) = false;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  std::uint64_t came_ ABSL_GUARDED_BY(mutex_) = 0;
  Lines opening_ ABSL_GUARDED_BY(mutex_);
  Lines watchers_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
