#include "server/calls/admission.h"

#include <utility>

#include "partiemc/status.h"

namespace partiemc::server {
namespace {

absl::Status TooManyConnections() {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyConnections), "caller.connections", "above a limit",
       "may only make health checks: the server, or this address, has too many connections, or too "
       "many new ones; use one connection for all calls, or try again later"});
}

absl::StatusOr<AdmittedCall> WithPlace(Caller caller, CallerAccount::Kind kind) {
  auto place = caller.account()->Take(kind);
  if (!place.ok()) return place.status();
  return AdmittedCall{std::move(caller), *std::move(place)};
}

}  // namespace

absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication, const CallOrigin& origin,
                                   Permission permission, std::string& client) {
  if (origin.is_health_only) return TooManyConnections();
  auto caller = authentication.Authenticate(origin.authorization, origin.peer);
  if (!caller.ok()) return caller.status();
  client = caller->name();
  if (permission != nullptr) {
    if (auto status = ((*caller).*permission)(); !status.ok()) return status;
  }
  return WithPlace(*std::move(caller), CallerAccount::Kind::kCall);
}

absl::StatusOr<AdmittedCall> AdmitProbe(const Authentication& authentication,
                                        const CallOrigin& origin) {
  return WithPlace(authentication.Anybody(origin.peer), CallerAccount::Kind::kProbe);
}

}  // namespace partiemc::server
