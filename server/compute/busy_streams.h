// Counts recently active streams: at most this number of workers is needed at once.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace partiemc::server {

/// Counts the streams for which a frame of at least a given size was computed recently. The count
/// does not depend on which frames were computed at the same time. Not thread-safe.
class BusyStreams {
 public:
  using Clock = std::chrono::steady_clock;

  /// The data that BusyStreams keeps about one stream. The stream owns this object.
  class Mark {
    friend class BusyStreams;
    // The last period in which the stream was counted (at first none), and its size class then.
    std::int64_t period_ = std::numeric_limits<std::int64_t>::min();
    std::size_t size_class_ = 0;
  };

  /// `late`: length of a period; after this time without a frame, Count returns 0. Positive.
  explicit BusyStreams(Clock::duration late) : late_(late) {}

  /// Records that a frame of `size` (in any unit) was computed for `stream`. `now` never decreases.
  /// Allocates nothing.
  void Worked(Mark& stream, std::size_t size, Clock::time_point now);

  /// Counts the streams with a frame of at least `size` in the current period, and those in the
  /// previous period. Returns the larger count. Rounds `size` down to a power of two. Returns 0 if
  /// the last such frame was computed at `now - late` or earlier.
  std::size_t Count(std::size_t size, Clock::time_point now) const;

 private:
  struct SizeClass {
    Clock::time_point last;
    std::size_t streams = 0, streams_before = 0;  // In the current period; in the previous one.
  };

  std::int64_t Period(Clock::time_point now) const { return now.time_since_epoch() / late_; }

  const Clock::duration late_;
  std::int64_t period_ = 0;  // The current period, as of the last call of Worked.
  // Class k: sizes of k bits, so from 2^(k-1) to 2^k - 1; class 0: size 0.
  std::array<SizeClass, std::numeric_limits<std::size_t>::digits + 1> classes_;
};

}  // namespace partiemc::server
