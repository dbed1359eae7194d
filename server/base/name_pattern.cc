#include "server/base/name_pattern.h"

#include <cstddef>
#include <optional>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace partiemc::server {

// Matches greedily from left to right and backtracks to the last `*` only. This suffices: the text
// before the last `*` has matched as early as possible, which leaves the most characters for the
// rest.
bool MatchesPattern(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0;
  std::optional<std::size_t> after_star;
  std::size_t star_ends = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      after_star = ++p;
      star_ends = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (after_star) {
      p = *after_star;
      n = ++star_ends;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 40;
  return absl::StrCat("\"", absl::CHexEscape(std::string(text.substr(0, kShown))), "\"",
                      text.size() > kShown ? "..." : "");
}

}  // namespace partiemc::server
