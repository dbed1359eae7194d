// Reads the times of frames from a separate file.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// The time by index of the frame in the input, from 0.
using FrameTimes = std::map<std::size_t, double>;

/// Reads a times file as SequenceOptions::times describes it.
absl::StatusOr<FrameTimes> ReadTimes(const std::string& path);

/// Whether `path` has the name times.csv and columns frame and t (or time).
bool IsTimesFile(const std::string& path);

}  // namespace partiemc::client::input
