#include "server/rpc/call_metrics.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <string>

#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::server {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

// As other languages' libraries spell the codes, by their number.
constexpr std::array<const char*, 17> kCodes = {
    "OK",       "Canceled",       "Unknown",          "InvalidArgument",   "DeadlineExceeded",
    "NotFound", "AlreadyExists",  "PermissionDenied", "ResourceExhausted", "FailedPrecondition",
    "Aborted",  "OutOfRange",     "Unimplemented",    "Internal",          "Unavailable",
    "DataLoss", "Unauthenticated"};

struct MethodMeters {
  prometheus::Counter* started = nullptr;
  prometheus::Counter* received = nullptr;
  prometheus::Counter* sent = nullptr;
  std::array<prometheus::Counter*, kCodes.size()> handled{};
  prometheus::Histogram* seconds = nullptr;
};

class CallMeter final : public Interceptor {
 public:
  explicit CallMeter(const MethodMeters& meters) : meters_(meters) { meters_.started->Increment(); }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr) {
      meters_.received->Increment();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      meters_.sent->Increment();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const auto code = static_cast<std::size_t>(methods->GetSendStatus().error_code());
      meters_.handled[std::min(code, kCodes.size() - 1)]->Increment();
      meters_.seconds->Observe(
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
    }
    methods->Proceed();
  }

 private:
  const MethodMeters& meters_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

prometheus::Family<prometheus::Counter>& AddFamily(Metrics& metrics, const char* name,
                                                   const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(metrics.registry());
}

class CallMeterFactory final : public ServerInterceptorFactoryInterface {
 public:
  // All series are there from the start, at zero.
  explicit CallMeterFactory(Metrics& metrics) {
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
      MethodMeters& meters = meters_["/" + service.full_name() + "/" + method.name()];
      meters.started = &started.Add(labels);
      meters.received = &received.Add(labels);
      meters.sent = &sent.Add(labels);
      meters.seconds = &seconds.Add(labels, SecondsBuckets());
      for (std::size_t code = 0; code < kCodes.size(); ++code) {
        prometheus::Labels with_code = labels;
        with_code["grpc_code"] = kCodes[code];
        meters.handled[code] = &handled.Add(with_code);
      }
    }
  }

  Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    const auto meters = meters_.find(call->method());
    return meters == meters_.end() ? nullptr : new CallMeter(meters->second);
  }

 private:
  std::map<std::string, MethodMeters> meters_;
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> MakeCallMetrics(Metrics& metrics) {
  return std::make_unique<CallMeterFactory>(metrics);
}

}  // namespace partiemc::server
