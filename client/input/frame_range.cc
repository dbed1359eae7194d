#include "client/input/frame_range.h"

#include <optional>
#include <vector>

#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

absl::Status NoRange(std::string_view text) {
  return absl::InvalidArgumentError(
      Concat("--frames: '", text,
             "'; must be A:B (frames A to B - 1, counted from 0), A:, :B, A:B:STEP or one number"));
}

}  // namespace

absl::StatusOr<FrameRange> ParseFrameRange(std::string_view text) {
  FrameRange range;
  if (text.empty()) return range;
  const std::vector<std::string_view> parts = Split(text, ':');
  if (parts.size() > 3) return NoRange(text);
  std::optional<std::size_t> numbers[3];
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string_view part = parts[k];
    if (part.empty()) continue;
    numbers[k] = ParseCount(part);
    if (!numbers[k]) return NoRange(text);
  }
  range.begin = numbers[0].value_or(range.begin);
  range.end = numbers[1].value_or(range.end);
  range.step = numbers[2].value_or(range.step);
  if (parts.size() == 1) {
    if (!numbers[0] || range.begin == range.end) return NoRange(text);
    range.end = range.begin + 1;
  }
  if (range.step == 0 || range.begin >= range.end) return NoRange(text);
  return range;
}

}  // namespace partiemc::client::input
