// The calls of our service, counted under the conventional names grpc_server_*, whatever carries
// them.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/histogram.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "server/telemetry/metrics.h"

namespace partiemc::server {

/// Of the calls of one method; atomic counters, some ten nanoseconds each. Safe from any thread.
class MethodMeters {
 public:
  static constexpr std::size_t kCodes = 17;

  void Started() const { started_->Increment(); }
  void Received() const { received_->Increment(); }
  void Sent() const { sent_->Increment(); }
  void Handled(absl::StatusCode code, std::chrono::steady_clock::duration time) const;

 private:
  friend class CallMeters;

  prometheus::Counter* started_ = nullptr;
  prometheus::Counter* received_ = nullptr;
  prometheus::Counter* sent_ = nullptr;
  std::array<prometheus::Counter*, kCodes> handled_{};
  prometheus::Histogram* seconds_ = nullptr;
};

class CallMeters {
 public:
  /// All series are there from the start, at zero. `metrics` lives longer.
  explicit CallMeters(Metrics& metrics);

  /// `method`: its name in the .proto, one of our service.
  const MethodMeters& Of(std::string_view method) const { return meters_.find(method)->second; }

 private:
  std::map<std::string, MethodMeters, std::less<>> meters_;
};

}  // namespace partiemc::server
