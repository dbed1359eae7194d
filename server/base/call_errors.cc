#include "server/base/call_errors.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {

absl::Status ProtocolError(std::string found, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonProtocol), "request", std::move(found), std::move(rule)});
}

absl::Status DrainingError() {
  return ViolationError(absl::StatusCode::kUnavailable,
                        {std::string(kReasonDraining), "server", "draining",
                         "connect to another one, or again later"});
}

absl::Status ClientGone() { return absl::CancelledError("the client went away"); }

absl::Status IdleError(std::string what, std::chrono::milliseconds limit, std::string rule) {
  const std::string seconds = absl::StrCat(std::chrono::duration<double>(limit).count(), " s");
  return ViolationError(
      absl::StatusCode::kDeadlineExceeded,
      {std::string(kReasonIdle), "client", absl::StrCat(what, " for ", seconds), std::move(rule)});
}

}  // namespace partiemc::server
