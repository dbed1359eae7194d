#include "common/json_text.h"

#include "common/printable.h"

namespace partiemc {

std::string JsonString(std::string_view text) {
  std::string out = "\"";
  while (!text.empty()) {
    const std::string_view before = text;
    const auto character = TakeCharacter(text);
    const std::string_view whole = before.substr(0, before.size() - text.size());
    if (character == U'"' || character == U'\\') {
      out += '\\';
      out += whole;
    } else if (!character) {
      out += "\\ufffd";
    } else if (IsControl(*character)) {
      out += Printable(whole);
    } else {
      out += whole;
    }
  }
  return out + '"';
}

}  // namespace partiemc
