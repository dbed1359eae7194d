// Detects a dead WebSocket.
#pragma once

#include <algorithm>
#include <chrono>

#include "server/web/context.h"

namespace partiemc::server {

/// Decides when the gateway sends a ping to a client and when it gives the client up. Two events
/// are signs of life: a received byte, and an acknowledgement of sent bytes by the client's
/// machine.
class SignsOfLife {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  enum class Next { kWait, kPing, kGiveUp };

  /// `write`: time limit for writing one message; 0: no limit.
  SignsOfLife(WebPings pings, std::chrono::milliseconds write, TimePoint now)
      : pings_(pings), write_(write), last_(now) {}

  /// Interval for calling Check.
  std::chrono::milliseconds interval() const {
    return std::max(std::min(pings_.interval, pings_.timeout) / 4, std::chrono::milliseconds(10));
  }

  void OnSign(TimePoint now) {
    last_ = now;
    pinged_ = false;
  }
  void WriteBegan(TimePoint now) { write_began_ = now; }

  /// Returns the next step. `unsent`: bytes that the client's machine has not acknowledged; a
  /// change is a sign of life. The silence is not measured while the gateway reads nothing, because
  /// it would miss signs of life. It is not measured while a message is being written either,
  /// because a ping would have to wait.
  Next Check(TimePoint now, bool reading, bool writing, long unsent) {
    if (writing && write_.count() > 0 && now - write_began_ > write_) return Next::kGiveUp;
    if (unsent != unsent_ || !reading || writing) {
      unsent_ = unsent;
      last_ = now;
    }
    if (now - last_ < pings_.interval) return Next::kWait;
    if (!pinged_) {
      pinged_ = true;
      return Next::kPing;
    }
    return now - last_ < pings_.interval + pings_.timeout ? Next::kWait : Next::kGiveUp;
  }

 private:
  const WebPings pings_;
  const std::chrono::milliseconds write_;
  TimePoint last_, write_began_;
  bool pinged_ = false;
  long unsent_ = 0;
};

}  // namespace partiemc::server
