// The frames that a watcher has seen, and the guarantees for them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/client/watcher.h"
#include "resume/history.h"

namespace partiemc::resume {

struct WatchedAnswer {
  std::uint64_t sequence = 0, dropped = 0, gap = 0;
  std::uint64_t rings_digest = 0, mesh_digest = 0, surface_digest = 0;
  bool rejoined = false;  ///< The first frame after the watch was lost.
  Clock::time_point at;
};

struct WatchHistory {
  std::vector<WatchedAnswer> seen;
  std::uint64_t dropped_at_end = 0;
  std::string reason;  ///< Reason of the reported end.
  absl::Status end;    ///< OK if an end was reported.
};

/// Receives until the watch ends.
WatchHistory WatchAll(client::Watcher& watcher);

/// Sequence numbers increase: no frame is out of order or repeated.
testing::AssertionResult Rising(const WatchHistory& history);
/// For a stream of `sent` frames without refusals: from the first seen frame on, each frame was
/// seen, counted as dropped, or is in a gap. Gaps occur only after a loss.
testing::AssertionResult Accounted(const WatchHistory& history, std::uint64_t sent);
/// Each frame equals the frame of an undisturbed run.
testing::AssertionResult Identical(const WatchHistory& history, const History& undisturbed);

}  // namespace partiemc::resume
