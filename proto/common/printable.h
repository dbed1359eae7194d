// Text of others, names and labels say, as it may stand on a terminal, in a log or in a message.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace partiemc {

/// Takes the first character off `text`. Nothing where its first byte begins no character of UTF-8
/// (RFC 3629); then that byte alone is taken off. Requires: `text` is not empty.
std::optional<char32_t> TakeCharacter(std::string_view& text);

/// Whether a terminal would obey this character instead of showing it: C0, DEL and C1, the
/// separators of lines and paragraphs, and what changes the direction of text.
bool IsControl(char32_t character);

/// Whether `text` is UTF-8 without control characters.
bool IsPrintable(std::string_view text);

/// `text` with escapes in place of all else: "\u001b" for a control character, "\xff" for a byte
/// that belongs to no character. Always valid UTF-8.
std::string Printable(std::string_view text);

}  // namespace partiemc
