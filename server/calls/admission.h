// Admits or refuses calls.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/authentication.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// Where a call comes from, as its transport reports.
struct CallOrigin {
  std::string peer;                          ///< As CallChannel::peer.
  std::optional<std::string> authorization;  ///< "Bearer TOKEN"; absent without a token.
  /// Whether the connection may only make health checks, because it exceeds a limit.
  bool is_health_only = false;
};

/// Reason of a call whose connection may only make health checks (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyConnections = "TOO_MANY_CONNECTIONS";

/// An admitted call. While `place` exists, the call counts against the caller's quota.
struct AdmittedCall {
  Caller caller;
  CallerAccount::Place place;
};

/// Checks a permission of a caller, such as Caller::CheckMayProduce. Null: no check.
using Permission = absl::Status (Caller::*)() const;

/// Authenticates the caller of a new call and checks its permission and its quota, before the
/// server reads a request. Sets `client` to the name of the caller (Caller::name) if it is
/// authenticated. Thread-safe. Errors: UNAUTHENTICATED, PERMISSION_DENIED (NOT_PERMITTED),
/// RESOURCE_EXHAUSTED (CALLER_CALLS, TOO_MANY_CONNECTIONS).
absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication, const CallOrigin& origin,
                                   Permission permission, std::string& client);

/// Admits a health check, which needs no token. Health checks have a separate quota, so other calls
/// cannot block them. Errors: RESOURCE_EXHAUSTED (CALLER_CALLS).
absl::StatusOr<AdmittedCall> AdmitProbe(const Authentication& authentication,
                                        const CallOrigin& origin);

}  // namespace partiemc::server
