// The selected frames of an input.
#pragma once

#include <cstddef>
#include <limits>
#include <string_view>

#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// Selects the frames with the indices `begin`, `begin + step`, and so on, below `end`.
struct FrameRange {
  std::size_t begin = 0;
  std::size_t end = std::numeric_limits<std::size_t>::max();
  std::size_t step = 1;

  bool Contains(std::size_t index) const {
    return index >= begin && index < end && (index - begin) % step == 0;
  }
  /// The number of selected frames among 0 .. count - 1.
  std::size_t CountOf(std::size_t count) const {
    const std::size_t last = end < count ? end : count;
    return last > begin ? (last - begin - 1) / step + 1 : 0;
  }
};

/// Parses SequenceOptions::frames; empty text selects all. Errors: kInvalidArgument.
absl::StatusOr<FrameRange> ParseFrameRange(std::string_view text);

}  // namespace partiemc::client::input
