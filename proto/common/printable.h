// Text of others, names and labels say, as it may stand on a terminal, in a log or in a message.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace partiemc {

/// Removes the first character of `text` and returns it. If `text` does not begin with a character
/// of UTF-8 (RFC 3629), removes one byte and returns nothing. Requires: `text` is not empty.
std::optional<char32_t> TakeCharacter(std::string_view& text);

/// True for characters that a terminal interprets instead of showing: C0, DEL and C1, line and
/// paragraph separators, and characters that change the direction of text.
bool IsControl(char32_t character);

/// Whether `text` is UTF-8 without control characters.
bool IsPrintable(std::string_view text);

/// `text` with escapes in place of all else: "\u001b" for a control character, "\xff" for a byte
/// that belongs to no character. Always valid UTF-8.
std::string Printable(std::string_view text);

}  // namespace partiemc
