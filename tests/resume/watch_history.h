// What a watcher has seen, and the guarantees that it is judged by afterwards.
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
  std::uint64_t rings_digest = 0, mesh_digest = 0;
  bool rejoined = false;  ///< The first after the watch had been lost.
  Clock::time_point at;
};

struct WatchHistory {
  std::vector<WatchedAnswer> seen;
  std::uint64_t dropped_at_end = 0;
  std::string reason;  ///< Of the end that was told.
  absl::Status end;    ///< OK where one was told.
};

/// Receives until the watch is over.
WatchHistory WatchAll(client::Watcher& watcher);

/// Sequence numbers rise: nothing is out of order or shown twice.
testing::AssertionResult Rising(const WatchHistory& history);
/// Of a stream of `sent` frames of which none was refused, each from the first that was seen on was
/// seen, was counted as dropped, or lies in a gap; and a gap is told only after a loss.
testing::AssertionResult Accounted(const WatchHistory& history, std::uint64_t sent);
/// Each frame is that of a run that nothing has disturbed.
testing::AssertionResult Identical(const WatchHistory& history, const History& undisturbed);

}  // namespace partiemc::resume
