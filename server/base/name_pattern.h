// Patterns of stream names, as a token file has them.
#pragma once

#include <string_view>

namespace partiemc::server {

/// Whether `pattern` stands for the whole of `name`: `*` for any characters or none, `?` for any
/// one, every other character for itself. Takes at most as many steps as the product of their
/// lengths.
bool MatchesPattern(std::string_view pattern, std::string_view name);

}  // namespace partiemc::server
