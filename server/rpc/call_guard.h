// Admits or refuses calls of services that are not the server's own, and counts them for their
// connections.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/connections/connection_table.h"
#include "server/security/authentication.h"

namespace partiemc::server {

/// Guards services that come with gRPC (reflection). Counts each call for its connection, and ends
/// a call with UNAUTHENTICATED if Authentication refuses its caller. Leaves the server's own
/// service and health checks alone. The arguments outlive the server. Thread-safe.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication, const ConnectionTable& connections);

}  // namespace partiemc::server
