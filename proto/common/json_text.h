// Text as JSON has it.
#pragma once

#include <string>
#include <string_view>

namespace partiemc {

/// `text` as a JSON string, quotes and all. Control characters are escaped, so that a terminal does
/// not obey what is printed; what is no UTF-8 becomes U+FFFD.
std::string JsonString(std::string_view text);

}  // namespace partiemc
