// Text inside of HTML pages.
#pragma once

#include <string>
#include <string_view>

namespace partiemc::client {

/// `text` as HTML shows it: harmless between tags and in quoted attributes, whatever it holds. File
/// names, stream names and messages are untrusted.
std::string EscapeHtml(std::string_view text);

}  // namespace partiemc::client
