#include "server/rpc/call_guard.h"

#include <grpc/grpc.h>
#include <grpcpp/alarm.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "server/calls/admission.h"
#include "server/calls/requests.h"
#include "server/rpc/grpc_call.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

// Ends a call with a status. Thread-safe.
void End(grpc_call* call, const absl::Status& status) {
  grpc_call_cancel_with_status(call, static_cast<grpc_status_code>(status.code()),
                               std::string(status.message()).c_str(), nullptr);
}

// Interceptor that ends a refused call before the call's method has read anything.
class Guard final : public Interceptor {
 public:
  Guard(const Authentication& authentication, const ConnectionTable& connections,
        std::chrono::milliseconds longest, grpc::ServerContextBase& context)
      : authentication_(authentication),
        longest_(longest),
        context_(context),
        tally_(connections.BeginCall(context.peer(), CallKind::kOther)) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      CallOrigin origin = OriginOf(context_);
      origin.is_health_only = tally_.is_health_only();
      std::string client;
      if (const auto status = TakePlaces(origin, client); status.ok()) {
        EndInTime();
      } else {
        LogRefusal("call refused", origin.peer, status, client);
        End(context_.c_call(), status);
      }
    }
    methods->Proceed();
  }

 private:
  absl::Status TakePlaces(const CallOrigin& origin, std::string& client) {
    auto admitted = Admit(authentication_, origin, nullptr, client);
    if (!admitted.ok()) return admitted.status();
    auto place = admitted->caller.account()->Take(CallerAccount::Kind::kReflection);
    if (!place.ok()) return place.status();
    admitted_ = *std::move(admitted);
    reflection_ = *std::move(place);
    return absl::OkStatus();
  }

  // The reflection service waits for the next request without a time limit.
  void EndInTime() {
    grpc_call* const call = context_.c_call();
    grpc_call_ref(call);  // The alarm may expire while the call ends.
    alarm_.Set(std::chrono::system_clock::now() + longest_, [call](bool expired) {
      if (expired) {
        End(call,
            absl::DeadlineExceededError("call: still open; must end soon after its last request"));
      }
      grpc_call_unref(call);
    });
  }

  const Authentication& authentication_;
  const std::chrono::milliseconds longest_;
  grpc::ServerContextBase& context_;
  const CallTally tally_;
  std::optional<AdmittedCall> admitted_;
  CallerAccount::Place reflection_;
  grpc::Alarm alarm_;
};

class GuardFactory final : public ServerInterceptorFactoryInterface {
 public:
  GuardFactory(const Authentication& authentication, const ConnectionTable& connections,
               std::chrono::milliseconds longest)
      : authentication_(authentication), connections_(connections), longest_(longest) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    const std::string_view method = call->method();
    if (method.starts_with("/grpc.health.v1.Health/") ||
        method.starts_with("/" + ServiceName() + "/")) {
      return nullptr;
    }
    return new Guard(authentication_, connections_, longest_, *call->server_context());
  }

 private:
  const Authentication& authentication_;
  const ConnectionTable& connections_;
  const std::chrono::milliseconds longest_;
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication, const ConnectionTable& connections,
    std::chrono::milliseconds longest) {
  return std::make_unique<GuardFactory>(authentication, connections, longest);
}

}  // namespace partiemc::server
