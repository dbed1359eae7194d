// Admits or refuses calls.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/authentication.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The origin of a call, as its transport reports it.
struct CallOrigin {
  std::string peer;                          ///< As CallChannel::peer.
  std::optional<std::string> authorization;  ///< "Bearer TOKEN".
};

/// An admitted call, and its place in the caller's quota until the call ends.
struct AdmittedCall {
  Caller caller;
  CallerAccount::Place place;
};

/// A check of the caller's permissions, such as Caller::CheckMayProduce. Null: none.
using Permission = absl::Status (Caller::*)() const;

/// Each call begins with this, before anything of a request is read. Thread-safe.
/// Errors: UNAUTHENTICATED, PERMISSION_DENIED (NOT_PERMITTED), RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication, const CallOrigin& origin,
                                   Permission permission = nullptr);

/// As Admit, for a health check, which needs no token. Its quota is separate, so other calls keep
/// no probe out. Errors: RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> AdmitProbe(const Authentication& authentication,
                                        const CallOrigin& origin);

}  // namespace partiemc::server
