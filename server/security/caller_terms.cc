#include "server/security/caller_terms.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "common/text.h"
#include "server/base/name_pattern.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kMaxNameBytes = 64;
// Maximum number of name patterns of a token. It limits the time of ListStreams, which compares
// each open stream with all patterns.
constexpr std::size_t kMaxPatterns = 32;

constexpr char kMayRule[] = "may= must have one or more of produce,watch,list, each once";
constexpr char kNamesRule[] =
    "names= must have 1 to 32 patterns of [A-Za-z0-9._*?-] with commas between them, each of at "
    "most 128 characters";
constexpr char kCountRule[] = "calls=, streams= and watchers= must be whole numbers from 1 on";
constexpr char kBytesRule[] =
    "bytes= must be a whole number from 1 on, and a unit (B, KB, MB, GB, TB, also KiB and so on) "
    "or none";
constexpr char kWordRule[] =
    "after the token and a name may stand may=, names=, calls=, streams=, watchers= and bytes=, "
    "each once and nothing else";
constexpr char kQuotaRule[] =
    "must be calls=, streams=, watchers= or bytes= and a number, each once, with blanks between "
    "them";
constexpr char kNameRule[] = "a name must be at most 64 characters of [A-Za-z0-9._-]";

bool Consists(std::string_view text, std::string_view of) {
  return std::all_of(text.begin(), text.end(), [of](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || of.find(c) != of.npos;
  });
}

bool ReadMay(std::string_view text, CallerTerms& terms) {
  terms.may_produce = terms.may_watch = terms.may_list = false;
  for (const std::string_view word : Split(text, ',')) {
    bool* const may = word == "produce" ? &terms.may_produce
                      : word == "watch" ? &terms.may_watch
                      : word == "list"  ? &terms.may_list
                                        : nullptr;
    if (may == nullptr || std::exchange(*may, true)) return false;
  }
  return true;
}

bool ReadNames(std::string_view text, CallerTerms& terms) {
  const std::vector<std::string_view> names = Split(text, ',');
  terms.names.assign(names.begin(), names.end());
  return terms.names.size() <= kMaxPatterns &&
         std::ranges::all_of(terms.names, [](const std::string& pattern) {
           return !pattern.empty() && pattern.size() <= kMaxStreamNameBytes &&
                  Consists(pattern, "._*?-");
         });
}

// Parses a positive number at the front of `text` and removes it. Returns false if there is none.
template <typename Number>
bool ReadNumber(std::string_view& text, std::optional<Number>& number) {
  number = ConsumeNumber<Number>(text);
  return number.value_or(0) > 0;
}

bool ReadCount(std::string_view text, std::optional<std::uint32_t>& count) {
  return ReadNumber(text, count) && text.empty();
}

bool ReadBytes(std::string_view text, std::optional<std::uint64_t>& bytes) {
  if (!ReadNumber(text, bytes)) return false;
  constexpr std::string_view kUnits = "kmgt";
  const std::string unit = absl::AsciiStrToLower(std::string(text));
  if (unit.empty() || unit == "b") return true;
  const std::size_t power = kUnits.find(unit.front());
  if (power == kUnits.npos || (unit.substr(1) != "b" && unit.substr(1) != "ib")) return false;
  const std::uint64_t factor = std::uint64_t{1} << (10 * (power + 1));
  if (*bytes > std::numeric_limits<std::uint64_t>::max() / factor) return false;
  *bytes *= factor;
  return true;
}

// Stores the value of the word `key=value` in `quota`. Returns the rule that it breaks, or null.
// `otherwise`: the rule for another key.
const char* ReadQuota(std::string_view key, std::string_view value, const char* otherwise,
                      CallerQuota& quota) {
  if (key == "calls") return ReadCount(value, quota.calls) ? nullptr : kCountRule;
  if (key == "streams") return ReadCount(value, quota.streams) ? nullptr : kCountRule;
  if (key == "watchers") return ReadCount(value, quota.watchers) ? nullptr : kCountRule;
  if (key == "bytes") return ReadBytes(value, quota.bytes) ? nullptr : kBytesRule;
  return otherwise;
}

// Stores the value of the word `key=value` in `terms`. Returns the rule that it breaks, or null.
const char* Read(std::string_view key, std::string_view value, CallerTerms& terms) {
  if (key == "may") return ReadMay(value, terms) ? nullptr : kMayRule;
  if (key == "names") return ReadNames(value, terms) ? nullptr : kNamesRule;
  return ReadQuota(key, value, kWordRule, terms.quota);
}

}  // namespace

bool CallerTerms::MayUse(std::string_view stream_name) const {
  return std::ranges::any_of(names, [stream_name](const std::string& pattern) {
    return pattern == "*" ||
           (stream_name.size() <= kMaxStreamNameBytes && MatchesPattern(pattern, stream_name));
  });
}

absl::StatusOr<CallerTerms> ParseCallerTerms(std::span<const std::string> words) {
  CallerTerms terms;
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string_view word = words[i];
    const std::size_t equals = word.find('=');
    const char* broken = nullptr;
    if (equals != word.npos) {
      const std::string_view key = word.substr(0, equals);
      broken = seen.insert(key).second ? Read(key, word.substr(equals + 1), terms) : kWordRule;
    } else if (i > 0) {
      broken = kWordRule;
    } else {
      broken = word.size() <= kMaxNameBytes && Consists(word, "._-") ? nullptr : kNameRule;
      terms.name = word;
    }
    if (broken != nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("word ", i + 2, ": ", broken));
    }
  }
  return terms;
}

absl::StatusOr<CallerQuota> ParseCallerQuota(std::string_view text) {
  CallerQuota quota;
  std::set<std::string_view> seen;
  for (const std::string_view word : Split(text, ' ')) {
    if (word.empty()) continue;
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string_view key = word.substr(0, equals);
    const std::string_view value = word.substr(std::min(equals + 1, word.size()));
    const char* const broken =
        seen.insert(key).second ? ReadQuota(key, value, kQuotaRule, quota) : kQuotaRule;
    if (broken != nullptr)
      return absl::InvalidArgumentError(absl::StrCat(std::string(word), ": ", broken));
  }
  return quota;
}

}  // namespace partiemc::server
