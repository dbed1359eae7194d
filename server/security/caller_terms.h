// Permissions and quota of a caller.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// Limits of one caller. If a value is absent, only the limits of the server apply.
struct CallerQuota {
  std::optional<std::uint32_t> calls;     ///< Concurrent calls of all methods.
  std::optional<std::uint32_t> streams;   ///< Open streams.
  std::optional<std::uint32_t> watchers;  ///< Open watches.
  /// Bytes of requests and responses held by the server; separately, bytes of states of streams.
  std::optional<std::uint64_t> bytes;

  friend bool operator==(const CallerQuota&, const CallerQuota&) = default;
};

/// The default permits everything.
struct CallerTerms {
  std::string name;  ///< For the log.
  bool may_produce = true;
  bool may_watch = true;
  bool may_list = true;
  std::vector<std::string> names = {"*"};  ///< Patterns of stream names (MatchesPattern).
  CallerQuota quota;

  /// Whether a pattern of `names` matches the name. Does not check may_produce, may_watch or
  /// may_list.
  bool MayUse(std::string_view stream_name) const;
};

/// Parses the words that follow a token in a token file (OPERATIONS.md, "Certificates, tokens,
/// keys"): `[NAME] [may=produce,watch,list] [names=PATTERN,...] [calls=N] [streams=N] [watchers=N]
/// [bytes=N]`. N of `bytes` may have a unit, a power of 1024 (64MB). NAME has 1 to 64 characters of
/// [A-Za-z0-9._-] and must be first. The other words may have any order, each once. Errors:
/// INVALID_ARGUMENT, "word K: RULE"; the token counts as word 1. The message does not contain the
/// word, which may be a misplaced token.
absl::StatusOr<CallerTerms> ParseCallerTerms(std::span<const std::string> words);

/// Parses limits of a caller, with the words of ParseCallerTerms and blanks between them:
/// "streams=4 watchers=16 bytes=64MB". Errors: INVALID_ARGUMENT with the word and the rule.
absl::StatusOr<CallerQuota> ParseCallerQuota(std::string_view text);

}  // namespace partiemc::server
