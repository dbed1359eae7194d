// Authenticates callers of all methods by their bearer tokens.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "server/security/bearer_tokens.h"
#include "server/security/caller.h"
#include "server/security/peer_accounts.h"

namespace partiemc::server {

/// Reasons of refused callers (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTokenMissing = "TOKEN_MISSING";
inline constexpr std::string_view kReasonTokenUnknown = "TOKEN_UNKNOWN";

/// Thread-safe.
class Authentication {
 public:
  /// `quota` applies to callers without a token, and to each value that the terms of a token do not
  /// set.
  explicit Authentication(CallerQuota quota = {}) : quota_(quota), peers_(quota) {}

  /// Replaces the tokens. Before the first call of this function, callers need no token. A token
  /// that is also in the new list keeps its account: the resources that it holds still count, and
  /// its new quota applies to further resources. Called by one thread at a time.
  void Set(BearerTokens tokens) ABSL_LOCKS_EXCLUDED(mutex_);
  bool required() const { return Current() != nullptr; }

  /// Finds the caller of a request. Before the first Set, same as `Anybody`. `authorization` is the
  /// request header of this name, "Bearer TOKEN"; `peer` is the client's address in gRPC's format.
  /// Errors: UNAUTHENTICATED with a Violation that does not contain the token.
  absl::StatusOr<Caller> Authenticate(std::optional<std::string_view> authorization,
                                      std::string_view peer) const;
  /// Returns a caller with all permissions and the account of its host (PeerAccounts).
  Caller Anybody(std::string_view peer) const { return Caller(everything_, peers_.Of(peer)); }

 private:
  struct Known {
    BearerTokens tokens;
    std::map<BearerTokens::Digest, std::shared_ptr<CallerAccount>> accounts;  // One per token.
  };
  std::shared_ptr<const Known> Current() const ABSL_LOCKS_EXCLUDED(mutex_);

  const CallerQuota quota_;
  const std::shared_ptr<const CallerTerms> everything_ = std::make_shared<const CallerTerms>();
  mutable PeerAccounts peers_;
  mutable Mutex mutex_;
  std::shared_ptr<const Known> known_ ABSL_GUARDED_BY(mutex_);  // Null: no token is required.
};

}  // namespace partiemc::server
