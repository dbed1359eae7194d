// Lets calls of services that are not ours in, or refuses them.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/security/authentication.h"

namespace partiemc::server {

/// For services that are not ours (reflection): ends calls that Authentication refuses with
/// UNAUTHENTICATED. Health checks come in without a token, as probes have none. `authentication`
/// outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication);

}  // namespace partiemc::server
