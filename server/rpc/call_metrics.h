// The calls of gRPC, counted under the conventional names grpc_server_*.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/telemetry/metrics.h"

namespace partiemc::server {

/// Counts the calls of our service, their messages, their ends by code, and their duration. Costs
/// some hundred nanoseconds a message. `metrics` outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallMetrics(
    Metrics& metrics);

}  // namespace partiemc::server
