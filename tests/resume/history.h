// The events that the user of a stream has seen, and the guarantees for them.
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
  std::uint64_t rings_digest = 0, mesh_digest = 0, surface_digest = 0;
  std::vector<std::uint64_t> identities;  ///< Of rings or shells; digests do not cover them.
  double time = 0;
  Clock::time_point at;

  /// Equal except for the time of arrival.
  bool SameAs(const Answer& other) const {
    return sequence == other.sequence && is_result == other.is_result &&
           rings_digest == other.rings_digest && mesh_digest == other.mesh_digest &&
           surface_digest == other.surface_digest && identities == other.identities &&
           time == other.time;
  }
};

/// One stream as seen by its user.
struct History {
  std::uint64_t sent = 0;
  std::vector<Answer> answers;                   ///< In the order of delivery.
  std::vector<Clock::time_point> reconnections;  ///< Times of the reports.
  std::size_t most_in_flight = 0;
  absl::Status end;  ///< OK if the stream ended normally.
};

/// Every sent frame was answered, and the stream ended normally.
testing::AssertionResult Complete(const History& history);
/// Answers arrived in the order of the frames.
testing::AssertionResult Ordered(const History& history);
/// No frame was answered twice.
testing::AssertionResult Unique(const History& history);
/// Each answer equals the answer of an undisturbed run.
testing::AssertionResult Identical(const History& history, const History& undisturbed);
/// Never more frames in flight than allowed.
testing::AssertionResult Bounded(const History& history, std::size_t window);

/// Checks all of them; failures name the guarantee.
void ExpectGuarantees(const History& history, const History& undisturbed, std::size_t window,
                      const std::string& what);

}  // namespace partiemc::resume
