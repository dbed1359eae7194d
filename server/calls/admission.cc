#include "server/calls/admission.h"

#include <utility>

namespace partiemc::server {
namespace {

absl::StatusOr<AdmittedCall> WithPlace(Caller caller, CallerAccount::Kind kind) {
  auto place = caller.account()->Take(kind);
  if (!place.ok()) return place.status();
  return AdmittedCall{std::move(caller), *std::move(place)};
}

}  // namespace

absl::StatusOr<AdmittedCall> Admit(const Authentication& authentication, const CallOrigin& origin,
                                   Permission permission) {
  auto caller = authentication.Authenticate(origin.authorization, origin.peer);
  if (!caller.ok()) return caller.status();
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
