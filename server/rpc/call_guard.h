// Lets the calls of gRPC in, or refuses them.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/authentication.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// A call that was let in, and its place, which it keeps until its end is told.
struct AdmittedCall {
  Caller caller;
  CallerAccount::Place place;
};

/// What a caller must be allowed to do: Caller::CheckMayProduce and its kin; none: nothing.
using Permission = absl::Status (Caller::*)() const;

/// Each method of our service begins with this, before anything of a request is read.
/// Errors: UNAUTHENTICATED, PERMISSION_DENIED (NOT_PERMITTED), RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication,
                                   const grpc::ServerContextBase& context,
                                   Permission permission = nullptr);

/// As Admit, for who needs no token: a probe. Errors: RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> AdmitAnybody(const Authentication& authentication,
                                          const grpc::ServerContextBase& context);

/// For services that are not ours (reflection): ends calls that Authentication refuses with
/// UNAUTHENTICATED. Health checks come in without a token, as probes have none. `authentication`
/// outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeGuardOfForeignServices(
    const Authentication& authentication);

}  // namespace partiemc::server
