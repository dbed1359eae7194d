// Stream names: matches them with the patterns of a token file, and quotes them in messages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace partiemc::server {

inline constexpr std::size_t kMaxStreamNameBytes = 128;

/// True if `pattern` matches the whole `name`. `*` matches any sequence of characters (also an
/// empty one), `?` matches any single character, and any other character matches itself. Cost: the
/// product of the lengths.
bool MatchesPattern(std::string_view pattern, std::string_view name);

/// Quotes a client's text for messages and the log: its first 40 bytes, escaped, between quotes. If
/// the text is longer, "..." follows.
std::string Quoted(std::string_view text);

}  // namespace partiemc::server
