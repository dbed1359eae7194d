// Lets calls in, or refuses them.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/authentication.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// What a transport knows of who calls.
struct CallOrigin {
  std::string peer;                          ///< As CallChannel::peer.
  std::optional<std::string> authorization;  ///< "Bearer TOKEN".
};

/// A call that was let in, and its place, which it keeps until its end is told.
struct AdmittedCall {
  Caller caller;
  CallerAccount::Place place;
};

/// What a caller must be allowed to do: Caller::CheckMayProduce and its kin; none: nothing.
using Permission = absl::Status (Caller::*)() const;

/// Each call begins with this, before anything of a request is read.
/// Errors: UNAUTHENTICATED, PERMISSION_DENIED (NOT_PERMITTED), RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication, const CallOrigin& origin,
                                   Permission permission = nullptr);

/// As Admit, for a health check, which needs no token. It is counted apart from other calls, so
/// that these keep no probe out. Errors: RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> AdmitProbe(const Authentication& authentication,
                                        const CallOrigin& origin);

}  // namespace partiemc::server
