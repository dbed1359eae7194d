// Makes untrusted text, such as names and labels, safe for terminals, logs and messages.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace partiemc {

/// Removes the first character of `text` and returns it. If `text` does not begin with a character
/// of UTF-8 (RFC 3629), removes one byte and returns nothing. Requires: `text` is not empty.
std::optional<char32_t> TakeCharacter(std::string_view& text);

/// True for characters that a terminal interprets instead of showing: C0, DEL and C1, line and
/// paragraph separators, the byte order mark, and characters that change the direction of text.
bool IsControl(char32_t character);

/// Whether `text` is UTF-8 without control characters.
bool IsPrintable(std::string_view text);

/// `text` with escapes: "\u001b" for a control character, "\xff" for a byte that belongs to no
/// character. Always valid UTF-8.
std::string Printable(std::string_view text);

}  // namespace partiemc
