#include "server/rpc/call_guard.h"

#include <grpc/grpc.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/rpc/unary_requests.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

constexpr char kHeader[] = "authorization";

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

absl::StatusOr<Caller> Authenticate(const Authentication& authentication,
                                    const grpc::ServerContextBase& context) {
  const auto [begin, end] = context.client_metadata().equal_range(kHeader);
  std::optional<std::string_view> authorization;
  // Of several headers none counts: who is meant would depend on their order.
  if (begin != end && std::next(begin) == end) {
    authorization.emplace(begin->second.data(), begin->second.size());
  }
  return authentication.Authenticate(authorization, context.peer());
}

// Ends a refused call before its method has read anything.
class Guard final : public Interceptor {
 public:
  Guard(const Authentication& authentication, grpc::ServerContextBase& context)
      : authentication_(authentication), context_(context) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const auto client = Authenticate(authentication_, context_);
      if (!client.ok()) {
        LogRefusal("call refused", context_.peer(), client.status());
        grpc_call_cancel_with_status(context_.c_call(), GRPC_STATUS_UNAUTHENTICATED,
                                     std::string(client.status().message()).c_str(), nullptr);
      }
    }
    methods->Proceed();
  }

 private:
  const Authentication& authentication_;
  grpc::ServerContextBase& context_;
};

class GuardFactory final : public ServerInterceptorFactoryInterface {
 public:
  explicit GuardFactory(const Authentication& authentication) : authentication_(authentication) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    const std::string_view method = call->method();
    if (method.starts_with("/grpc.health.v1.Health/") ||
        method.starts_with("/" + ServiceName() + "/")) {
      return nullptr;
    }
    return new Guard(authentication_, *call->server_context());
  }

 private:
  const Authentication& authentication_;
};

absl::StatusOr<AdmittedCall> WithPlace(Caller caller) {
  auto place = caller.account()->Take(CallerAccount::Kind::kCall);
  if (!place.ok()) return place.status();
  return AdmittedCall{std::move(caller), *std::move(place)};
}

}  // namespace

absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication,
                                   const grpc::ServerContextBase& context, Permission permission) {
  auto caller = Authenticate(authentication, context);
  if (!caller.ok()) return caller.status();
  if (permission != nullptr) {
    if (auto status = ((*caller).*permission)(); !status.ok()) return status;
  }
  return WithPlace(*std::move(caller));
}

absl::StatusOr<AdmittedCall> AdmitAnybody(const Authentication& authentication,
                                          const grpc::ServerContextBase& context) {
  return WithPlace(authentication.Anybody(context.peer()));
}

std::unique_ptr<ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication) {
  return std::make_unique<GuardFactory>(authentication);
}

}  // namespace partiemc::server
