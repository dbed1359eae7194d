// Whether a caller may come in, and as whom: by its bearer token, whichever method it calls.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/bearer_tokens.h"
#include "server/security/caller.h"
#include "server/security/peer_accounts.h"

namespace partiemc::server {

/// The reasons for which a caller is turned away (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTokenMissing = "TOKEN_MISSING";
inline constexpr std::string_view kReasonTokenUnknown = "TOKEN_UNKNOWN";

/// Safe from any thread.
class Authentication {
 public:
  /// `quota` is that of a peer without a token, and of a token what its terms leave open.
  explicit Authentication(CallerQuota quota = {}) : quota_(quota), peers_(quota) {}

  /// From now on only callers with one of these tokens come in; before the first, everybody does. A
  /// token that was there before keeps its account: what it holds still counts, and the new quota
  /// for what it takes from now on. Called by one thread at a time.
  void Set(BearerTokens tokens);
  bool required() const { return Current() != nullptr; }

  /// `authorization` is the caller's header of that name, "Bearer TOKEN"; `peer` where it comes
  /// from, as gRPC writes it. Errors: UNAUTHENTICATED, whose Violation never shows what the caller
  /// sent.
  absl::StatusOr<Caller> Authenticate(std::optional<std::string_view> authorization,
                                      std::string_view peer) const;
  /// A caller who needs no token, known by where it comes from.
  Caller Anybody(std::string_view peer) const { return Caller(everything_, peers_.Of(peer)); }

 private:
  struct Known {
    BearerTokens tokens;
    std::map<BearerTokens::Digest, std::shared_ptr<CallerAccount>> accounts;  // One for each token.
  };
  std::shared_ptr<const Known> Current() const;

  const CallerQuota quota_;
  const std::shared_ptr<const CallerTerms> everything_ = std::make_shared<const CallerTerms>();
  mutable PeerAccounts peers_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Known> known_;  // Guarded by mutex_; none: everybody comes in.
};

}  // namespace partiemc::server
