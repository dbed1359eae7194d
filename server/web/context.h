// The state that all connections of the gateway share.
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

/// Timing of pings. The gateway sends a ping to a connection that is silent for `interval`, and
/// closes the connection if it stays silent for `timeout` after that.
struct WebPings {
  std::chrono::milliseconds interval, timeout;
};

/// Counts partiemc_web_refusals_total.
class WebRefusals {
 public:
  explicit WebRefusals(Metrics& metrics);

  void Count(WebRefusal refusal) { counters_[static_cast<std::size_t>(refusal)]->Increment(); }

 private:
  std::array<prometheus::Counter*, kWebRefusals> counters_{};
};

/// The referenced objects must outlive the context. Thread-safe.
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

  /// Counts and logs a refused request.
  void Refuse(WebRefusal refusal, const std::string& peer, const absl::Status& why);
};

/// Time limit for the handshakes of a connection, for receiving the header of a request, and for
/// the pause between two requests.
inline constexpr std::chrono::seconds kWebHeaderTime{10};
/// Time limit for sending a response that does not belong to a call, and for each piece of a file.
inline constexpr std::chrono::seconds kWebResponseTime{30};
/// Time limit for sending the end of a call and for closing the connection afterwards.
inline constexpr std::chrono::seconds kWebCloseTime{5};

}  // namespace partiemc::server
