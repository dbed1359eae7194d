// Remembers recent callers: shows whether a caller competes with another caller.
#pragma once

#include <chrono>

namespace partiemc::server {

class CallerAccount;

/// Remembers the last caller and the last caller that differs from it. These two suffice for
/// AnybodyBut. Not thread-safe.
class RecentCallers {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Records that `caller` was active at `now`. Requires: `now` never decreases.
  void Came(const CallerAccount* caller, TimePoint now) {
    if (!last_.came || last_.caller != caller) other_ = last_;
    last_ = {caller, now, true};
  }
  /// Whether a caller other than `caller` was active at `since` or later.
  bool AnybodyBut(const CallerAccount* caller, TimePoint since) const {
    const Visit& visit = last_.caller == caller ? other_ : last_;
    return visit.came && visit.time >= since;
  }

 private:
  struct Visit {
    const CallerAccount* caller = nullptr;
    TimePoint time;
    bool came = false;
  };

  Visit last_, other_;  // Visits of two different callers.
};

}  // namespace partiemc::server
