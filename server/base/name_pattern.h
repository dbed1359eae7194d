// Names of streams, and patterns of them as a token file has them.
#pragma once

#include <cstddef>
#include <string_view>

namespace partiemc::server {

inline constexpr std::size_t kMaxStreamNameBytes = 128;

/// Whether `pattern` stands for the whole of `name`: `*` for any characters or none, `?` for any
/// one, every other character for itself. Takes at most as many steps as the product of their
/// lengths.
bool MatchesPattern(std::string_view pattern, std::string_view name);

}  // namespace partiemc::server
