// Text in HTML pages.
#pragma once

#include <string>
#include <string_view>

namespace partiemc::client {

/// Escapes `text` for use between tags and in quoted attributes. File names, stream names and
/// messages are untrusted.
std::string EscapeHtml(std::string_view text);

}  // namespace partiemc::client
