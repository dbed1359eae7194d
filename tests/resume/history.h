// What the user of a stream has seen, and the guarantees that it is judged by afterwards.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::resume {

using Clock = std::chrono::steady_clock;

struct Answer {
  std::uint64_t sequence = 0;
  bool is_result = false;
  std::uint64_t rings_digest = 0, mesh_digest = 0;
  std::vector<std::uint64_t> identities;  ///< Of the rings, which digests leave out.
  double time = 0;
  Clock::time_point at;

  /// But for when it came.
  bool SameAs(const Answer& other) const {
    return sequence == other.sequence && is_result == other.is_result &&
           rings_digest == other.rings_digest && mesh_digest == other.mesh_digest &&
           identities == other.identities && time == other.time;
  }
};

/// One stream from its user's side.
struct History {
  std::uint64_t sent = 0;
  std::vector<Answer> answers;                   ///< As delivered.
  std::vector<Clock::time_point> reconnections;  ///< When they were told.
  std::size_t most_in_flight = 0;
  absl::Status end;  ///< OK for a stream that ended as it should.
};

/// Every frame that was sent has been answered, and the stream has ended well.
testing::AssertionResult Complete(const History& history);
/// Answers came in the order of the frames.
testing::AssertionResult Ordered(const History& history);
/// No frame was answered twice.
testing::AssertionResult Unique(const History& history);
/// Each answer is that of a run that nothing has disturbed.
testing::AssertionResult Identical(const History& history, const History& undisturbed);
/// Never more frames in flight than were allowed.
testing::AssertionResult Bounded(const History& history, std::size_t window);

/// All of them, named when they fail.
void ExpectGuarantees(const History& history, const History& undisturbed, std::size_t window,
                      const std::string& what);

}  // namespace partiemc::resume
