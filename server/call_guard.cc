#include "server/call_guard.h"

#include <grpc/grpc.h>

#include <optional>
#include <string_view>

#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "server/logging.h"

namespace partiemc::server {
namespace {

constexpr char kHeader[] = "authorization";

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

// Ends a refused call before its method has read anything.
class Guard final : public Interceptor {
 public:
  Guard(const Authentication& authentication, grpc::ServerContextBase& context)
      : authentication_(authentication), context_(context) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const auto client = Authenticate(authentication_, context_);
      if (!client.ok()) {
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
    const std::string ours =
        std::string("/") + v1::ReconstructionService::service_full_name() + "/";
    if (method.starts_with("/grpc.health.v1.Health/") || method.starts_with(ours)) return nullptr;
    return new Guard(authentication_, *call->server_context());
  }

 private:
  const Authentication& authentication_;
};

}  // namespace

absl::StatusOr<std::string> Authenticate(const Authentication& authentication,
                                         const grpc::ServerContextBase& context) {
  const auto [begin, end] = context.client_metadata().equal_range(kHeader);
  std::optional<std::string_view> authorization;
  // Of several headers none counts: who is meant would depend on their order.
  if (begin != end && std::next(begin) == end) {
    authorization.emplace(begin->second.data(), begin->second.size());
  }
  auto client = authentication.Authenticate(authorization);
  if (!client.ok()) LogRefusal("call refused", context.peer(), client.status());
  return client;
}

std::unique_ptr<ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication) {
  return std::make_unique<GuardFactory>(authentication);
}

}  // namespace partiemc::server
