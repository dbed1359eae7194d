// Joins text and numbers.
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace partiemc::client {

/// Appends `value` in the shortest form that parses to the same bits; independent of the locale.
/// Infinities and NaN become "inf", "-inf" and "nan".
template <typename Number>
requires(std::integral<Number> || std::floating_point<Number>) void AppendNumber(std::string& out,
                                                                                 Number value) {
  char buffer[32];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value).ptr);
}

/// "0,0.5,10": numbers by AppendNumber.
inline std::string NumberList(std::span<const double> numbers) {
  std::string out;
  for (const double number : numbers) {
    if (!out.empty()) out += ',';
    AppendNumber(out, number);
  }
  return out;
}

/// Appends text and numbers, numbers by AppendNumber. (absl::StrCat rounds to six digits, and does
/// not accept std::string_view in Debian's abseil.)
template <typename... Parts>
void AppendAll(std::string& out, const Parts&... parts) {
  const auto append = [&out](const auto& part) {
    using Part = std::decay_t<decltype(part)>;
    if constexpr (std::is_same_v<Part, char>) {
      out += part;
    } else if constexpr (std::is_arithmetic_v<Part>) {
      static_assert(!std::is_same_v<Part, bool>, "pass a text instead of a bool");
      AppendNumber(out, part);
    } else {
      out += std::string_view(part);
    }
  };
  (append(parts), ...);
}

template <typename... Parts>
std::string Concat(const Parts&... parts) {
  std::string out;
  AppendAll(out, parts...);
  return out;
}

/// Appends the characters of a JSON string, without its quotes.
inline void AppendJsonEscaped(std::string& out, std::string_view text) {
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      AppendAll(out, "\\u00", "01"[c >> 4 & 1], "0123456789abcdef"[c & 15]);
    } else {
      out += c;
    }
  }
}

/// "1 frame", "2 frames".
inline std::string Plural(std::uint64_t count, std::string_view noun) {
  return Concat(count, " ", noun, count == 1 ? "" : "s");
}

/// The 16 hexadecimal digits of a digest.
inline std::string DigestText(std::uint64_t digest) {
  std::string text(16, '0');
  for (std::size_t k = 16; k-- > 0; digest >>= 4) text[k] = "0123456789abcdef"[digest & 15];
  return text;
}

}  // namespace partiemc::client
