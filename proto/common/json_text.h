// Text in JSON.
#pragma once

#include <string>
#include <string_view>

namespace partiemc {

/// `text` as a JSON string with its quotes. Control characters are escaped, so that the output is
/// safe to print on a terminal. Invalid UTF-8 becomes U+FFFD.
std::string JsonString(std::string_view text);

}  // namespace partiemc
