// The calls whose next request may be of any size: nobody knows before all of it has come.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The reason for which a call gives way (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyOpening = "TOO_MANY_OPENING";

/// Those that have begun and have not sent their first request yet, of which there is room for so
/// many. When one more comes, another one gives way: the oldest of the caller that has most of
/// them, and of the oldest such caller where several have. So nobody is kept out by calls that stay
/// mute, whoever makes them, and who sends its request at once is never among the oldest for long.
///
/// Beside them the watchers, which may send a further request at any time. They are counted
/// elsewhere, and give way only where memory runs short. Safe from any thread.
class OpeningCalls {
 public:
  /// Ends the call with that status, unless its first request has come meanwhile. It may come when
  /// the place has gone already, and from any thread.
  using GiveWay = std::function<void(const absl::Status&)>;

 private:
  /// The calls of each caller, in the order in which they came. Not thread-safe.
  class Lines {
   public:
    void Add(const CallerAccount* caller, std::uint64_t number, GiveWay give_way);
    /// Empty where it has gone already.
    GiveWay Remove(const CallerAccount* caller, std::uint64_t number);
    /// Of the caller that has most the oldest. Requires: there is one.
    GiveWay RemoveNext();
    /// Of the caller that has most the older half, at least one. Requires: there is one.
    std::vector<GiveWay> RemoveHalf();
    std::size_t count() const { return count_; }

   private:
    // A caller's calls by their numbers, which rise.
    using Line = std::map<std::uint64_t, GiveWay>;
    // How many a caller has, and its oldest call, negative where less is to come first.
    using Rank = std::pair<std::size_t, std::int64_t>;

    static Rank RankOf(const Line& line);

    std::size_t count_ = 0;
    std::map<const CallerAccount*, Line> lines_;  // None is empty.
    std::map<Rank, const CallerAccount*> ranks_;  // The last one's first call is the next to go.
  };

 public:
  /// Of one call, until its next request has come or it is over.
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

  /// Has room for at least one.
  explicit OpeningCalls(std::size_t places) : places_(places) {}

  /// To be called without a lock: it may end another call. The account and this outlive the place.
  Place Enter(const CallerAccount& caller, GiveWay give_way);
  /// As Enter, for a watcher that may send another request from now on.
  Place EnterWatcher(const CallerAccount& caller, GiveWay give_way);

  /// More has come in with them than the server has memory for: of the caller that has most of them
  /// the older half gives way, at least one. To be called without a lock.
  void GiveWayToAll();
  /// The same for the watchers.
  void WatchersGiveWay();

  /// Returns true as soon as there is one, or `also` returns true; false from StopWaiting on. For
  /// one thread.
  bool WaitForOne(const std::function<bool()>& also = [] { return false; });
  /// What `also` depends on has changed.
  void LookAgain();
  void StopWaiting();

  /// Without the watchers.
  std::size_t count() const;

 private:
  Place Take(Lines& lines, const CallerAccount& caller, GiveWay give_way);  // With the lock held.
  void HalfGivesWay(Lines& lines, const absl::Status& status);              // Without.

  const std::size_t places_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable one_came_;
  bool waits_for_one_ = false, stopped_ = false;
  std::uint64_t came_ = 0;
  Lines opening_, watchers_;
};

}  // namespace partiemc::server
