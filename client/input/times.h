// Times of frames from a file beside the frames.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// Time by 0-based index of the frame in the input.
using FrameTimes = std::map<std::size_t, double>;

/// Reads a times file as SequenceOptions::times describes it.
absl::StatusOr<FrameTimes> ReadTimes(const std::string& path);

/// Whether `path` is called times.csv and names the columns frame and t (or time).
bool IsTimesFile(const std::string& path);

}  // namespace partiemc::client::input
