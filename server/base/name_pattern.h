// Matches names of streams with the patterns of a token file.
#pragma once

#include <cstddef>
#include <string_view>

namespace partiemc::server {

inline constexpr std::size_t kMaxStreamNameBytes = 128;

/// True if `pattern` matches all of `name`: `*` matches any characters or none, `?` any one, any
/// other character itself. Cost: the product of their lengths.
bool MatchesPattern(std::string_view pattern, std::string_view name);

}  // namespace partiemc::server
