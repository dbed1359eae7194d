// The calls that have begun and have not sent their first request yet.
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

#include "absl/status/status.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The reason for which a call gives way (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyOpening = "TOO_MANY_OPENING";

/// Has room for so many of them. When one more comes, another one gives way: the oldest of the
/// caller that has most of them, and of the oldest such caller where several have. So nobody is
/// kept out by calls that stay mute, whoever makes them, and who sends its request at once is never
/// among the oldest for long. Safe from any thread.
class OpeningCalls {
 public:
  /// Ends the call with that status, unless its first request has come meanwhile. It may come when
  /// the place has gone already, and from any thread that enters another call.
  using GiveWay = std::function<void(const absl::Status&)>;

  /// Of one call, until its first request has come or it is over.
  class Place {
   public:
    Place() = default;
    Place(Place&& other) noexcept { *this = std::move(other); }
    Place& operator=(Place&& other) noexcept {
      std::swap(calls_, other.calls_);
      std::swap(caller_, other.caller_);
      std::swap(number_, other.number_);
      return *this;
    }
    ~Place();

   private:
    friend class OpeningCalls;
    OpeningCalls* calls_ = nullptr;
    const CallerAccount* caller_ = nullptr;
    std::uint64_t number_ = 0;
  };

  /// At least one.
  explicit OpeningCalls(std::size_t places) : places_(places) {}

  /// To be called without a lock: it may end another call. The account and this outlive the place.
  Place Enter(const CallerAccount& caller, GiveWay give_way);

  /// More has come in with them than the server has memory for: of the caller that has most of them
  /// the older half gives way, at least one. To be called without a lock.
  void GiveWayToAll();

  /// Returns true as soon as there is one, false from StopWaiting on. For one thread.
  bool WaitForOne();
  void StopWaiting();

  std::size_t count() const;

 private:
  // A caller's calls by their numbers, which rise.
  using Line = std::map<std::uint64_t, GiveWay>;
  // How many a caller has, and its oldest call, negative where less is to come first.
  using Rank = std::pair<std::size_t, std::int64_t>;

  void Leave(const CallerAccount* caller, std::uint64_t number);
  // With the lock held:
  static Rank RankOf(const Line& line);
  void Add(const CallerAccount* caller, std::uint64_t number, GiveWay give_way);
  GiveWay Remove(const CallerAccount* caller, std::uint64_t number);
  GiveWay RemoveNext();

  const std::size_t places_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable one_came_;
  bool waits_for_one_ = false, stopped_ = false;
  std::uint64_t came_ = 0;
  std::size_t count_ = 0;
  std::map<const CallerAccount*, Line> lines_;  // None is empty.
  std::map<Rank, const CallerAccount*> ranks_;  // The last one's first call is the next to go.
};

}  // namespace partiemc::server
