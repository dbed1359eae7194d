#include "server/authentication.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr std::string_view kScheme = "bearer ";

// The name of a scheme is written in any case (RFC 9110).
bool IsBearer(std::string_view authorization) {
  return absl::AsciiStrToLower(std::string(authorization.substr(0, kScheme.size()))) == kScheme;
}

absl::Status TurnedAway(std::string_view reason, std::string value) {
  return ViolationError(absl::StatusCode::kUnauthenticated,
                        {std::string(reason), "authorization", std::move(value),
                         "must be \"Bearer \" and a token of this server's --token-file"});
}

}  // namespace

void Authentication::Set(BearerTokens tokens) {
  auto next = std::make_shared<const BearerTokens>(std::move(tokens));
  const std::lock_guard lock(mutex_);
  tokens_.swap(next);
}

std::shared_ptr<const BearerTokens> Authentication::Current() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

absl::StatusOr<std::string> Authentication::Authenticate(
    std::optional<std::string_view> authorization) const {
  const auto tokens = Current();
  if (tokens == nullptr) return std::string();
  if (!authorization) return TurnedAway(kReasonTokenMissing, "absent");
  if (!IsBearer(*authorization)) {
    return TurnedAway(kReasonTokenMissing, "of another scheme");
  }
  auto client = tokens->ClientOf(authorization->substr(kScheme.size()));
  if (!client) return TurnedAway(kReasonTokenUnknown, "a token that is not known");
  return *std::move(client);
}

}  // namespace partiemc::server
