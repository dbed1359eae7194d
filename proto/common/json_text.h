// Writes text as JSON.
#pragma once

#include <string>
#include <string_view>

namespace partiemc {

/// `text` as a JSON string with its quotes. Control characters (IsControl) are escaped, so that the
/// output is safe to print on a terminal. A byte that belongs to no character becomes U+FFFD.
std::string JsonString(std::string_view text);

}  // namespace partiemc
