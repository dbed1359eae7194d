#include "server/rpc/call_guard.h"

#include <grpc/grpc.h>

#include <string>
#include <string_view>
#include <utility>

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

// Interceptor that ends a refused call before the call's method has read anything.
class Guard final : public Interceptor {
 public:
  Guard(const Authentication& authentication, const ConnectionTable& connections,
        grpc::ServerContextBase& context)
      : authentication_(authentication),
        context_(context),
        tally_(connections.BeginCall(context.peer(), CallKind::kOther)) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const CallOrigin origin = OriginOf(context_);
      const auto client = authentication_.Authenticate(origin.authorization, origin.peer);
      if (!client.ok()) {
        LogRefusal("call refused", origin.peer, client.status());
        grpc_call_cancel_with_status(context_.c_call(), GRPC_STATUS_UNAUTHENTICATED,
                                     std::string(client.status().message()).c_str(), nullptr);
      }
    }
    methods->Proceed();
  }

 private:
  const Authentication& authentication_;
  grpc::ServerContextBase& context_;
  const CallTally tally_;
};

class GuardFactory final : public ServerInterceptorFactoryInterface {
 public:
  GuardFactory(const Authentication& authentication, const ConnectionTable& connections)
      : authentication_(authentication), connections_(connections) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    const std::string_view method = call->method();
    if (method.starts_with("/grpc.health.v1.Health/") ||
        method.starts_with("/" + ServiceName() + "/")) {
      return nullptr;
    }
    return new Guard(authentication_, connections_, *call->server_context());
  }

 private:
  const Authentication& authentication_;
  const ConnectionTable& connections_;
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication, const ConnectionTable& connections) {
  return std::make_unique<GuardFactory>(authentication, connections);
}

}  // namespace partiemc::server
