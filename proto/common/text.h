// Splits text and reads numbers, independent of the locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace partiemc {

inline constexpr std::string_view kAsciiBlanks = " \t\r\n\v\f";

/// `text` without the characters of `blanks` at both ends.
std::string_view Strip(std::string_view text, std::string_view blanks = kAsciiBlanks);

/// The parts between separators, stripped of `blanks`; one empty part for an empty text.
std::vector<std::string_view> Split(std::string_view text, char separator,
                                    std::string_view blanks = kAsciiBlanks);

/// Removes `prefix` from the front of `text`. Returns false if `text` does not begin with it.
bool ConsumePrefix(std::string_view& text, std::string_view prefix);

/// Removes a decimal number from the front of `text`: digits for unsigned integers, "-1.5e3", "nan"
/// or "inf" for floating point. Removes and returns nothing if there is none in range.
template <typename Number>
std::optional<Number> ConsumeNumber(std::string_view& text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

/// The number that `text` consists of. Returns nothing if `text` is anything else.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  const auto number = ConsumeNumber<Number>(text);
  return text.empty() ? number : std::nullopt;
}

}  // namespace partiemc
