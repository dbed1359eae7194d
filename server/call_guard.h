// Lets the calls of gRPC in, or refuses them.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/authentication.h"

namespace partiemc::server {

/// Authentication::Authenticate for the caller of `context`; a refusal is logged. Each method of
/// our service asks this first, so that a refusal carries its reason.
absl::StatusOr<std::string> Authenticate(const Authentication& authentication,
                                         const grpc::ServerContextBase& context);

/// For services that are not ours (reflection): ends calls that Authentication refuses with
/// UNAUTHENTICATED. Health checks come in without a token, as probes have none. `authentication`
/// outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication);

}  // namespace partiemc::server
