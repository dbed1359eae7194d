// The parts of a serialised state (state.cc) that have a file of their own.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/state.h"

namespace partiemc {

inline constexpr std::size_t kRingBytes = 8 + 4 + 4 + 8 + 8;
inline constexpr std::size_t kRunBytes = 4 + 4 + 4 + 4;
inline constexpr std::size_t kSampleBytes = 8 + 4 + 4 + 4;

/// INVALID_ARGUMENT with a Violation of the reason CORRUPT_STATE.
absl::Status CorruptState(std::string value, std::string rule);

/// Appends rings, runs and samples.
void PutHistory(const RingHistory& history, std::string& bytes);

/// Takes what PutHistory appended, and checks all of `history`.
/// Requires: its time and number of identities have been read, its vectors have their sizes, and
/// `rest` has the bytes for them.
absl::Status TakeHistory(std::string_view& rest, RingHistory& history);

}  // namespace partiemc
