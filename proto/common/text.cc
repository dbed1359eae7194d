#include "common/text.h"

#include <algorithm>

namespace partiemc {

std::string_view Strip(std::string_view text, std::string_view blanks) {
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

std::vector<std::string_view> Split(std::string_view text, char separator,
                                    std::string_view blanks) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = std::min(text.find(separator), text.size());
    parts.push_back(Strip(text.substr(0, end), blanks));
    if (end == text.size()) return parts;
    text.remove_prefix(end + 1);
  }
}

bool ConsumePrefix(std::string_view& text, std::string_view prefix) {
  const bool has = text.starts_with(prefix);
  if (has) text.remove_prefix(prefix.size());
  return has;
}

}  // namespace partiemc
