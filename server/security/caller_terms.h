// What a caller may, and how much of the server it may hold.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// At most; nothing: no limit but the server's own.
struct CallerQuota {
  std::optional<std::uint32_t> calls;     ///< Of all methods, each from its beginning to its end.
  std::optional<std::uint32_t> streams;   ///< That are open.
  std::optional<std::uint32_t> watchers;  ///< That are open.
  std::optional<std::uint64_t> bytes;     ///< Of requests and answers that the server holds.

  friend bool operator==(const CallerQuota&, const CallerQuota&) = default;
};

/// By default everything.
struct CallerTerms {
  std::string name;  ///< For the log.
  bool may_produce = true;
  bool may_watch = true;
  bool may_list = true;
  std::vector<std::string> names = {"*"};  ///< Patterns of the streams' names (MatchesPattern).
  CallerQuota quota;

  /// Whether a stream of this name may be produced, watched and seen.
  bool MayUse(std::string_view stream_name) const;
};

/// What the words behind a token say (README, "The server"): [NAME] [may=produce,watch,list]
/// [names=PATTERN,...] [calls=N] [streams=N] [watchers=N] [bytes=N with a unit of 1024 as in 64MB].
/// NAME is 1 to 64 characters of [A-Za-z0-9._-], and first; the others come in any order, each
/// once. Errors: INVALID_ARGUMENT, "word K: RULE", where the token is word 1. No word is ever
/// shown: one of them may be a token at the wrong place.
absl::StatusOr<CallerTerms> ParseCallerTerms(std::span<const std::string> words);

}  // namespace partiemc::server
