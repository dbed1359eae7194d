// Matches stream names with the patterns of a token file.
#pragma once

#include <cstddef>
#include <string_view>

namespace partiemc::server {

inline constexpr std::size_t kMaxStreamNameBytes = 128;

/// True if `pattern` matches the whole `name`. `*` matches any sequence of characters (also an
/// empty one), `?` matches any single character, and any other character matches itself. Cost: the
/// product of the lengths.
bool MatchesPattern(std::string_view pattern, std::string_view name);

}  // namespace partiemc::server
