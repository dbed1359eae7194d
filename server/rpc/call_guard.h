// Counts calls of services that are not ours for their connections, and admits or refuses them.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/connections/connection_table.h"
#include "server/security/authentication.h"

namespace partiemc::server {

/// Guards services that are not ours (reflection): counts each call for its connection, and ends
/// calls that Authentication refuses with UNAUTHENTICATED. Health checks need no token. The
/// arguments outlive the server. Thread-safe.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication, const ConnectionTable& connections);

}  // namespace partiemc::server
