#include "client/input/base/number_text.h"

#include <charconv>
#include <cmath>
#include <system_error>

#include "absl/strings/numbers.h"
#include "common/text.h"

namespace partiemc::client::input {

std::optional<double> ParseNumber(std::string_view text) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return std::nullopt;
  }
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (stop != end || text.empty()) return std::nullopt;
  if (error == std::errc()) return number;
  // Out of range, which leaves `number` unchanged. SimpleAtod gives infinity or zero.
  if (error != std::errc::result_out_of_range ||
      !absl::SimpleAtod({text.data(), text.size()}, &number)) {
    return std::nullopt;
  }
  return number;
}

std::optional<std::uint64_t> ParseCount(std::string_view text) {
  return partiemc::ParseNumber<std::uint64_t>(text);
}

std::optional<std::uint64_t> ParseId(std::string_view text) {
  if (const auto count = ParseCount(text)) return count;
  const auto number = ParseNumber(text);
  return number ? IdOfNumber(*number) : std::nullopt;
}

std::optional<std::uint64_t> IdOfNumber(double number) {
  constexpr double kWholeBelow =
      9007199254740992.0;  // 2^53: above, not all integers are representable.
  if (!(number >= 0 && number < kWholeBelow) || std::trunc(number) != number) return std::nullopt;
  return static_cast<std::uint64_t>(number);
}

}  // namespace partiemc::client::input
