#include "client/input/base/natural_order.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"

namespace partiemc::client {
namespace {

std::string_view TakeDigits(std::string_view& text) {
  const auto end = std::find_if_not(text.begin(), text.end(), absl::ascii_isdigit);
  const auto length = static_cast<std::size_t>(end - text.begin());
  const std::string_view digits = text.substr(0, length);
  text.remove_prefix(length);
  return digits;
}

std::string_view WithoutLeadingZeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

std::string_view WithoutTrailingZeros(std::string_view digits) {
  return digits.substr(0, digits.find_last_not_of('0') + 1);
}

// Calls `visit` with the ordinal (from 0) of each run of digits after "<digits>.", with the run,
// and with whether it belongs to more than two numbers that are joined by points.
template <typename Visit>
void ForEachAfterPoint(std::string_view name, Visit visit) {
  std::size_t ordinal = 0;
  std::size_t joined = 0;  // Numbers before this one that points join.
  for (std::string_view rest = name; !rest.empty();) {
    if (!absl::ascii_isdigit(rest.front())) {
      const bool joins = rest.front() == '.' && rest.size() > 1 && absl::ascii_isdigit(rest[1]);
      if (!joins) joined = 0;
      rest.remove_prefix(1);
      continue;
    }
    const std::string_view digits = TakeDigits(rest);
    const bool continues = rest.size() > 1 && rest[0] == '.' && absl::ascii_isdigit(rest[1]);
    if (joined > 0) visit(ordinal++, digits, joined > 1 || continues);
    ++joined;
  }
}

// Properties of the runs of digits with the same ordinal, over all names.
struct RunsAfterPoint {
  std::size_t shortest = std::string_view::npos, longest = 0;
  std::size_t longest_with_zero_first = 0;  // Without the run "0".
  bool has_zero_last = false;               // Without the run "0".
  bool has_more_numbers = false;

  bool StartAsFractions() const { return longest_with_zero_first > shortest; }
  bool AreFractions() const {
    return longest > shortest && !has_more_numbers && (!has_zero_last || StartAsFractions());
  }
  bool AreUncertain() const { return has_zero_last == StartAsFractions(); }
};

std::vector<RunsAfterPoint> RunsOf(const std::vector<std::string>& names) {
  std::vector<RunsAfterPoint> all;
  for (const std::string& name : names) {
    ForEachAfterPoint(name, [&](std::size_t ordinal, std::string_view digits, bool more) {
      if (all.size() <= ordinal) all.resize(ordinal + 1);
      RunsAfterPoint& runs = all[ordinal];
      runs.shortest = std::min(runs.shortest, digits.size());
      runs.longest = std::max(runs.longest, digits.size());
      runs.has_more_numbers = runs.has_more_numbers || more;
      if (digits == "0") return;
      if (digits.front() == '0') {
        runs.longest_with_zero_first = std::max(runs.longest_with_zero_first, digits.size());
      }
      runs.has_zero_last = runs.has_zero_last || digits.back() == '0';
    });
  }
  return all;
}

// NaturalLess, except that a run of digits after "<digits>." compares as a fraction if
// `is_fraction` is set for its ordinal among such runs (from 0). Whether a run is after a point
// depends only on the text before it, which is equal in both names, so that this is a strict weak
// order.
bool Less(std::string_view a, std::string_view b, const std::vector<bool>& is_fraction) {
  const std::string_view whole_a = a;
  const std::string_view whole_b = b;
  std::size_t ordinal = 0;
  int last = 0;  // 2 after a digit, 1 after a digit and a point.
  while (!a.empty() && !b.empty()) {
    if (absl::ascii_isdigit(a.front()) && absl::ascii_isdigit(b.front())) {
      const bool is_after_point = last == 1;
      const bool fraction = is_after_point && ordinal < is_fraction.size() && is_fraction[ordinal];
      ordinal += is_after_point ? 1 : 0;
      last = 2;
      std::string_view number_a = TakeDigits(a);
      std::string_view number_b = TakeDigits(b);
      if (fraction) {
        number_a = WithoutTrailingZeros(number_a);
        number_b = WithoutTrailingZeros(number_b);
      } else {
        number_a = WithoutLeadingZeros(number_a);
        number_b = WithoutLeadingZeros(number_b);
        if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      }
      if (number_a != number_b) return number_a < number_b;
      continue;
    }
    if (a.front() != b.front()) return a.front() < b.front();
    last = last == 2 && a.front() == '.' ? 1 : 0;
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a < whole_b;
}

}  // namespace

bool NaturalLess(std::string_view a, std::string_view b) { return Less(a, b, {}); }

bool SortNaturally(std::vector<std::string>& names) {
  std::sort(names.begin(), names.end(), NaturalLess);
  std::vector<bool> is_fraction;
  bool uncertain = false;
  for (const RunsAfterPoint& runs : RunsOf(names)) {
    is_fraction.push_back(runs.AreFractions());
    uncertain = uncertain || (runs.AreFractions() && runs.AreUncertain());
  }
  const auto less = [&](const std::string& a, const std::string& b) {
    return Less(a, b, is_fraction);
  };
  if (std::is_sorted(names.begin(), names.end(), less)) return false;
  std::sort(names.begin(), names.end(), less);
  return uncertain;
}

}  // namespace partiemc::client
