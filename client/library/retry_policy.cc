#include "client/library/retry_policy.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"

namespace partiemc::client {
namespace {

constexpr std::string_view kDraining = "DRAINING";
// Reasons of refusals (proto/PROTOCOL.md) after which another attempt may succeed: the stream's
// former call may release its name, its slot or the memory of its state, and another server's
// version or keys may accept the checkpoint.
constexpr std::array<std::string_view, 10> kRetryableWhileResuming = {
    "NAME_IN_USE",    "TOO_MANY_STREAMS", "TOO_MANY_OPENING",    "TOO_MANY_CONNECTIONS",
    "CALLER_STREAMS", "CALLER_CALLS",     "CHECKPOINT_MISMATCH", "CHECKPOINT_SIGNATURE",
    "MEMORY_BUDGET",  "CALLER_BYTES"};

constexpr std::array<std::string_view, 5> kRetryableWhileJoining = {
    "NO_SUCH_STREAM", "LEADER_GONE", "TOO_MANY_OPENING", "TOO_MANY_CONNECTIONS", "CALLER_CALLS"};

bool IsRetryable(std::string_view reason, CallPurpose purpose) {
  switch (purpose) {
    case CallPurpose::kOpen:
      return false;
    case CallPurpose::kResume:
      return std::ranges::count(kRetryableWhileResuming, reason) > 0;
    case CallPurpose::kJoin:
      return std::ranges::count(kRetryableWhileJoining, reason) > 0;
  }
  return false;
}

}  // namespace

bool IsLostConnection(grpc::StatusCode code, std::string_view reason) {
  if (!reason.empty()) return reason == kDraining;
  switch (code) {
    case grpc::StatusCode::OK:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::CANCELLED:
      return true;
    default:
      return false;
  }
}

Loss LossOf(const StreamCall& call, CallPurpose purpose) {
  Loss loss{.status = FromGrpc(call.end(), call.address()),
            .why = Reason(call.end()),
            .retryable = IsLostConnection(call.end().error_code(), call.reason()) ||
                         IsRetryable(call.reason(), purpose)};
  if (loss.status.ok()) {
    loss.status = absl::UnavailableError(
        absl::StrCat("the server at ", call.address(), " ended the stream: start again"));
  }
  return loss;
}

}  // namespace partiemc::client
