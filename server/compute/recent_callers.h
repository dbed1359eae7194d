// Who has come lately, as far as one has to know whether anybody else has.
#pragma once

#include <chrono>

namespace partiemc::server {

class CallerAccount;

/// Remembers two callers, the last one and the last other one, which is all that it takes. Not
/// thread-safe.
class RecentCallers {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// At times that never fall.
  void Came(const CallerAccount* caller, TimePoint now) {
    if (!last_.came || last_.caller != caller) other_ = last_;
    last_ = {caller, now, true};
  }
  /// Whether one other than `caller` came at `since` or after it.
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

  Visit last_, other_;  // Of two callers.
};

}  // namespace partiemc::server
