// Text out of parts: words, and numbers in the shortest form that reads back the same.
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace partiemc::client {

/// Appends `value` in the shortest form that reads back the same bits in its own type; never
/// depends on the locale. Infinities and NaN become "inf", "-inf" and "nan": a format that has no
/// word for them must not get here with one.
template <typename Number>
requires(std::integral<Number> || std::floating_point<Number>) void AppendNumber(std::string& out,
                                                                                 Number value) {
  char buffer[32];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value).ptr);
}

/// Appends each part: text as it is, numbers as AppendNumber does. (absl::StrCat rounds numbers to
/// six digits, and knows no std::string_view in the abseil that distributions ship.)
template <typename... Parts>
void AppendAll(std::string& out, const Parts&... parts) {
  const auto append = [&out](const auto& part) {
    using Part = std::decay_t<decltype(part)>;
    if constexpr (std::is_same_v<Part, char>) {
      out += part;
    } else if constexpr (std::is_arithmetic_v<Part>) {
      static_assert(!std::is_same_v<Part, bool>, "say what is meant by it");
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
