#include "server/security/authentication.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr std::string_view kScheme = "bearer ";

// Whether the header's scheme is "Bearer". The name of a scheme is case-insensitive (RFC 9110).
bool IsBearer(std::string_view authorization) {
  return absl::AsciiStrToLower(std::string(authorization.substr(0, kScheme.size()))) == kScheme;
}

absl::Status TurnedAway(std::string_view reason, std::string value) {
  return ViolationError(absl::StatusCode::kUnauthenticated,
                        {std::string(reason), "authorization", std::move(value),
                         "must be \"Bearer \" and a token of this server's --token-file"});
}

// Returns the quota `asked`; values that it does not set are taken from `otherwise`.
CallerQuota Completed(const CallerQuota& asked, const CallerQuota& otherwise) {
  const auto either = [](const auto& one, const auto& other) { return one ? one : other; };
  return {.calls = either(asked.calls, otherwise.calls),
          .streams = either(asked.streams, otherwise.streams),
          .watchers = either(asked.watchers, otherwise.watchers),
          .bytes = either(asked.bytes, otherwise.bytes)};
}

}  // namespace

void Authentication::Set(BearerTokens tokens) {
  const auto before = Current();
  auto next = std::make_shared<Known>();
  for (const auto& [digest, terms] : tokens.clients()) {
    auto account = before && before->accounts.contains(digest) ? before->accounts.at(digest)
                                                               : std::make_shared<CallerAccount>();
    account->SetQuota(Completed(terms->quota, quota_));
    next->accounts.emplace(digest, std::move(account));
  }
  next->tokens = std::move(tokens);
  const MutexLock lock(mutex_);
  known_ = std::move(next);
}

std::shared_ptr<const Authentication::Known> Authentication::Current() const {
  const MutexLock lock(mutex_);
  return known_;
}

absl::StatusOr<Caller> Authentication::Authenticate(std::optional<std::string_view> authorization,
                                                    std::string_view peer) const {
  const auto known = Current();
  if (known == nullptr) return Anybody(peer);
  if (!authorization) return TurnedAway(kReasonTokenMissing, "absent");
  if (!IsBearer(*authorization)) {
    return TurnedAway(kReasonTokenMissing, "of another scheme");
  }
  const auto* const client = known->tokens.Find(authorization->substr(kScheme.size()));
  if (client == nullptr) return TurnedAway(kReasonTokenUnknown, "a token that is not known");
  return Caller(client->terms, known->accounts.at(client->digest));
}

}  // namespace partiemc::server
