// Converts absl::Status to gRPC's status.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "partiemc/status.h"
#include "server/rpc/error_details.h"

namespace partiemc::server {

/// The trailing metadata that carries the stable reason of a status (proto/PROTOCOL.md).
inline constexpr char kReasonMetadata[] = "partiemc-reason";

/// Converts a status to gRPC: same code and message, with ErrorDetails. Adds the reason of its
/// Violation to the trailing metadata of `context`. Called once per call, before the call is
/// finished.
inline grpc::Status ToGrpcStatus(const absl::Status& status, grpc::CallbackServerContext& context) {
  if (status.ok()) return grpc::Status::OK;
  if (const auto violation = FindViolation(status)) {
    context.AddTrailingMetadata(kReasonMetadata, violation->reason);
  }
  // gRPC and abseil number the codes alike.
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message()),
          ErrorDetails(status)};
}

}  // namespace partiemc::server
