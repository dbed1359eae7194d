// Counts the calls of partiemc's service, over any channel. The metrics have the conventional names
// grpc_server_*.
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

/// Counts the calls of one method. An increment takes about ten nanoseconds. Thread-safe.
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
  /// Creates all time series at once, with the value zero. `metrics` outlives this object.
  explicit CallMeters(Metrics& metrics);

  /// Requires: `method` is the name of a method of partiemc's service in the .proto file.
  const MethodMeters& Of(std::string_view method) const { return meters_.find(method)->second; }

 private:
  std::map<std::string, MethodMeters, std::less<>> meters_;
};

}  // namespace partiemc::server
