// Whether a caller may come in: by its bearer token, whichever door it knocks at.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/bearer_tokens.h"

namespace partiemc::server {

/// The reasons for which a caller is turned away (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTokenMissing = "TOKEN_MISSING";
inline constexpr std::string_view kReasonTokenUnknown = "TOKEN_UNKNOWN";

/// Safe from any thread.
class Authentication {
 public:
  /// From now on only callers with one of these tokens come in; before the first, everybody does.
  void Set(BearerTokens tokens);
  bool required() const { return Current() != nullptr; }

  /// `authorization` is the caller's header of that name, "Bearer TOKEN". The name of the client;
  /// empty where everybody comes in.
  /// Errors: UNAUTHENTICATED, whose Violation never shows what the caller sent.
  absl::StatusOr<std::string> Authenticate(std::optional<std::string_view> authorization) const;

 private:
  std::shared_ptr<const BearerTokens> Current() const;

  mutable std::mutex mutex_;
  std::shared_ptr<const BearerTokens> tokens_;  // Guarded by mutex_; none: everybody comes in.
};

}  // namespace partiemc::server
