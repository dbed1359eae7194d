// Tracks the calls whose next request may occupy unbounded memory: gRPC reports a message's size
// only after the whole message has arrived.
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

/// Limits the opening calls, that is, the calls that have not sent their first request. If a call
/// exceeds the limit, an opening call is evicted: the oldest call of the caller that has the most
/// opening calls. Among several such callers, the caller with the oldest call loses it. So silent
/// calls cannot block other callers, and a call that sends its request at once is hardly ever
/// evicted.
///
/// Also tracks watchers, because they may send another request at any time. WatchRegistry limits
/// their number. This class evicts watchers only if memory is exhausted. Thread-safe.
class OpeningCalls {
 public:
  /// Function that evicts a call: ends it with this status. Does nothing to an opening call whose
  /// first request has arrived. Called from any thread, possibly after the call's Place was
  /// destroyed.
  using GiveWay = std::function<void(const absl::Status&)>;

 private:
  /// The calls of each caller, oldest first. Not thread-safe.
  class Lines {
   public:
    void Add(const CallerAccount* caller, std::uint64_t number, GiveWay give_way);
    /// Removes a call and returns its function; an empty one if the call was removed before.
    GiveWay Remove(const CallerAccount* caller, std::uint64_t number);
    /// Removes the oldest call of the caller with the most calls. Requires: not empty.
    GiveWay RemoveNext();
    /// Removes the older half (rounded up) of the calls of the caller with the most calls.
    std::vector<GiveWay> RemoveHalf();
    std::size_t count() const { return count_; }

   private:
    // The calls of one caller by number. Numbers increase, so the oldest call comes first.
    using Line = std::map<std::uint64_t, GiveWay>;
    // The rank of a caller: the number of its calls, then the negated number of its oldest call.
    // The caller with the highest rank loses a call first.
    using Rank = std::pair<std::size_t, std::int64_t>;

    static Rank RankOf(const Line& line);

    std::size_t count_ = 0;
    std::map<const CallerAccount*, Line> lines_;  // Non-empty lines only.
    std::map<Rank, const CallerAccount*> ranks_;
  };

 public:
  /// The registration of a tracked call. Destroyed when the call's next request has arrived, or
  /// when the call ends.
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

  /// Tracks a new opening call; evicts another one if the limit is reached. Requires: the calling
  /// thread holds no lock. The account and this object outlive the returned Place.
  Place Enter(const CallerAccount& caller, GiveWay give_way) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Tracks a watcher, which may send another request from now on. Evicts no call.
  Place EnterWatcher(const CallerAccount& caller, GiveWay give_way) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Called if memory is exhausted. Evicts the older half (at least one) of the opening calls of
  /// the caller that has the most. Requires: the calling thread holds no lock.
  void GiveWayToAll() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Same as GiveWayToAll, but evicts watchers instead of opening calls.
  void WatchersGiveWay() ABSL_LOCKS_EXCLUDED(mutex_);

  /// Blocks until at least one call is tracked or `also` returns true, then returns true. Calls
  /// `also` with the lock held. Returns false after StopWaiting. Only one thread may wait.
  bool WaitForOne(const std::function<bool()>& also = [] { return false; })
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Makes WaitForOne evaluate `also` again.
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
