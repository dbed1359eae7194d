// Admits or refuses calls of services that are not the server's own, and counts them for their
// connections.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <chrono>
#include <memory>

#include "server/connections/connection_table.h"
#include "server/security/authentication.h"

namespace partiemc::server {

/// Guards services that come with gRPC (reflection). Counts each call for its connection and its
/// caller. Ends a call with UNAUTHENTICATED if Authentication refuses its caller, with
/// RESOURCE_EXHAUSTED if the caller has too many calls, and with DEADLINE_EXCEEDED if it is open
/// for longer than `longest`. Leaves the server's own service and health checks alone. The
/// referenced arguments outlive the server. Thread-safe.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication, const ConnectionTable& connections,
    std::chrono::milliseconds longest);

}  // namespace partiemc::server
