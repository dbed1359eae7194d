// What the connections of the gateway share.
#pragma once

#include <prometheus/counter.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "server/calls/methods.h"
#include "server/stream/limits.h"
#include "server/telemetry/metrics.h"
#include "server/web/connection_slots.h"
#include "server/web/page_files.h"
#include "server/web/requests.h"

namespace partiemc::server {

/// A connection without a sign of life for `interval` is asked for one, and closed if it gives none
/// within `timeout`.
struct WebPings {
  std::chrono::milliseconds interval, timeout;
};

/// partiemc_web_refusals_total.
class WebRefusals {
 public:
  explicit WebRefusals(Metrics& metrics);

  void Count(WebRefusal refusal) { counters_[static_cast<std::size_t>(refusal)]->Increment(); }

 private:
  std::array<prometheus::Counter*, kWebRefusals> counters_{};
};

/// What is passed by reference lives longer. Safe from any thread.
struct WebContext {
  const Methods& methods;
  const ServerLimits& limits;
  const WebPings pings;
  const WebRules rules;
  const PageFiles files;
  const std::string page_policy;  ///< PagePolicy.
  const std::function<bool()> draining;
  WebRefusals refusals;
  ConnectionSlots slots;

  /// Counts and logs what was not let in.
  void Refuse(WebRefusal refusal, const std::string& peer, const absl::Status& why);
};

/// For how long a connection may take for its handshakes and the header of a request, ...
inline constexpr std::chrono::seconds kWebHeaderTime{10};
/// ... for taking a response that is no answer of a call, ...
inline constexpr std::chrono::seconds kWebResponseTime{30};
/// ... for taking how its call ended, and closing.
inline constexpr std::chrono::seconds kWebCloseTime{5};

}  // namespace partiemc::server
