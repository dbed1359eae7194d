#include "server/calls/call_meters.h"

#include <algorithm>

#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::server {
namespace {

// Names of the status codes, indexed by number, spelled as in gRPC's metrics libraries for other
// languages.
constexpr std::array<const char*, MethodMeters::kCodes> kCodeNames = {
    "OK",       "Canceled",       "Unknown",          "InvalidArgument",   "DeadlineExceeded",
    "NotFound", "AlreadyExists",  "PermissionDenied", "ResourceExhausted", "FailedPrecondition",
    "Aborted",  "OutOfRange",     "Unimplemented",    "Internal",          "Unavailable",
    "DataLoss", "Unauthenticated"};

prometheus::Family<prometheus::Counter>& AddFamily(Metrics& metrics, const char* name,
                                                   const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(metrics.registry());
}

}  // namespace

void MethodMeters::Handled(absl::StatusCode code, std::chrono::steady_clock::duration time) const {
  handled_[std::min(static_cast<std::size_t>(code), kCodes - 1)]->Increment();
  seconds_->Observe(std::chrono::duration<double>(time).count());
}

CallMeters::CallMeters(Metrics& metrics) {
  auto& started = AddFamily(metrics, "grpc_server_started_total", "Calls begun.");
  auto& handled = AddFamily(metrics, "grpc_server_handled_total", "Calls ended, by code.");
  auto& received = AddFamily(metrics, "grpc_server_msg_received_total", "Messages received.");
  auto& sent = AddFamily(metrics, "grpc_server_msg_sent_total", "Messages sent.");
  auto& seconds = prometheus::BuildHistogram()
                      .Name("grpc_server_handling_seconds")
                      .Help("From the begin of a call to its end.")
                      .Register(metrics.registry());
  const auto& service =
      *v1::GetServerInfoRequest::descriptor()->file()->FindServiceByName("ReconstructionService");
  for (int i = 0; i < service.method_count(); ++i) {
    const auto& method = *service.method(i);
    const bool stream = method.client_streaming() || method.server_streaming();
    const prometheus::Labels labels = {{"grpc_type", stream ? "bidi_stream" : "unary"},
                                       {"grpc_service", service.full_name()},
                                       {"grpc_method", method.name()}};
    MethodMeters& meters = meters_[method.name()];
    meters.started_ = &started.Add(labels);
    meters.received_ = &received.Add(labels);
    meters.sent_ = &sent.Add(labels);
    meters.seconds_ = &seconds.Add(labels, SecondsBuckets());
    for (std::size_t code = 0; code < kCodeNames.size(); ++code) {
      prometheus::Labels with_code = labels;
      with_code["grpc_code"] = kCodeNames[code];
      meters.handled_[code] = &handled.Add(with_code);
    }
  }
}

}  // namespace partiemc::server
