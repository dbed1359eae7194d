#include "common/printable.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace partiemc {
namespace {

// First and last character of each range. All of them have at most four hexadecimal digits.
constexpr std::array<std::pair<char32_t, char32_t>, 7> kControls = {{
    {0x00, 0x1f},
    {0x7f, 0x9f},
    {0x061c, 0x061c},
    {0x200e, 0x200f},
    {0x2028, 0x202e},
    {0x2066, 0x2069},
    {0xfeff, 0xfeff},
}};

// Length of the character that begins with a byte, and its bits in this byte; 0: none begins so.
struct Lead {
  std::size_t bytes = 0;
  char32_t bits = 0;
};

Lead LeadOf(unsigned char lead) {
  if (lead < 0x80) return {1, lead};
  if (lead >= 0xc2 && lead < 0xe0) return {2, lead & 0x1fu};
  if (lead >= 0xe0 && lead < 0xf0) return {3, lead & 0x0fu};
  if (lead >= 0xf0 && lead < 0xf5) return {4, lead & 0x07u};
  return {};
}

void AppendHex(std::string& out, unsigned value, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    out += "0123456789abcdef"[(value >> shift) & 15];
  }
}

}  // namespace

std::optional<char32_t> TakeCharacter(std::string_view& text) {
  const std::string_view whole = text;
  text.remove_prefix(1);
  const Lead lead = LeadOf(static_cast<unsigned char>(whole.front()));
  if (lead.bytes == 0 || lead.bytes > whole.size()) return std::nullopt;
  char32_t character = lead.bits;
  for (std::size_t k = 1; k < lead.bytes; ++k) {
    const auto byte = static_cast<unsigned char>(whole[k]);
    if ((byte & 0xc0) != 0x80) return std::nullopt;
    character = (character << 6) | (byte & 0x3fu);
  }
  // Overlong encodings, surrogate halves, and values above the last character.
  constexpr std::array<char32_t, 5> kSmallest = {0, 0, 0x80, 0x800, 0x10000};
  if (character < kSmallest[lead.bytes] || character > 0x10ffff ||
      (character >= 0xd800 && character < 0xe000)) {
    return std::nullopt;
  }
  text.remove_prefix(lead.bytes - 1);
  return character;
}

bool IsControl(char32_t character) {
  return std::any_of(kControls.begin(), kControls.end(), [character](const auto& range) {
    return character >= range.first && character <= range.second;
  });
}

bool IsPrintable(std::string_view text) {
  while (!text.empty()) {
    const auto character = TakeCharacter(text);
    if (!character || IsControl(*character)) return false;
  }
  return true;
}

std::string Printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view before = text;
    const auto character = TakeCharacter(text);
    if (!character) {
      out += "\\x";
      AppendHex(out, static_cast<unsigned char>(before.front()), 2);
    } else if (IsControl(*character)) {
      out += "\\u";
      AppendHex(out, static_cast<unsigned>(*character), 4);
    } else {
      out += before.substr(0, before.size() - text.size());
    }
  }
  return out;
}

}  // namespace partiemc
