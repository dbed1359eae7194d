#include "server/rpc/health_service.h"

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.pb.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/requests.h"
#include "server/calls/unary_call.h"
#include "server/rpc/grpc_call.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

namespace health = grpc::health::v1;

absl::StatusOr<grpc::ByteBuffer> Check(grpc::ByteBuffer& bytes, bool serving) {
  health::HealthCheckRequest request;
  if (auto status = ParseRequest(bytes, kMaxSmallRequestBytes, request); !status.ok())
    return status;
  // An empty service name in the request means the whole server.
  if (!request.service().empty() && request.service() != ServiceName()) {
    return absl::NotFoundError("unknown service");
  }
  health::HealthCheckResponse response;
  response.set_status(serving ? health::HealthCheckResponse::SERVING
                              : health::HealthCheckResponse::NOT_SERVING);
  return wire::ToBytes(response);
}

}  // namespace

HealthService::HealthService(const ServerContext& context, const ConnectionTable& connections) {
  Serve("/grpc.health.v1.Health/Check", [&, this](grpc::CallbackServerContext* server_context) {
    return new GrpcCall(
        *server_context, connections, CallKind::kHealthCheck,
        [&, this](CallChannel& channel, const CallOrigin& origin) {
          return std::make_unique<UnaryCall>(
              ArrivedCall{channel, /*meters=*/nullptr, AdmitProbe(context.authentication, origin)},
              context, UnaryKind::kProbe,
              [this](grpc::ByteBuffer& bytes, Worker*, auto&) { return Check(bytes, serving_); });
        });
  });
}

}  // namespace partiemc::server
