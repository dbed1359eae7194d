// How many streams are at work, which is how many workers may be needed at once.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace partiemc::server {

/// Counts the streams that have had a frame of some size of late. What it tells follows from what
/// the streams send, not from whose frames happened to meet. Not thread-safe.
class BusyStreams {
 public:
  using Clock = std::chrono::steady_clock;

  /// What it remembers of one stream; belongs to the stream.
  class Mark {
    friend class BusyStreams;
    std::int64_t period_ = std::numeric_limits<std::int64_t>::min();  // The last one counted in.
    std::size_t size_class_ = 0;                                      // As what.
  };

  /// `late` is positive: how long ago "of late" goes back.
  explicit BusyStreams(Clock::duration late) : late_(late) {}

  /// `stream` has had a frame of this size. `now` never goes back. Allocates nothing.
  void Worked(Mark& stream, std::size_t size, Clock::time_point now);

  /// How many had a frame of at least `size`, rounded down to a power of two, within this period of
  /// `late` or the last one; 0 if nobody had for `late`.
  std::size_t Count(std::size_t size, Clock::time_point now) const;

 private:
  struct SizeClass {
    Clock::time_point last;
    std::size_t streams = 0, streams_before = 0;  // In `period_`; in the one before.
  };

  std::int64_t Period(Clock::time_point now) const { return now.time_since_epoch() / late_; }

  const Clock::duration late_;
  std::int64_t period_ = 0;  // The last one that Worked has seen.
  // Number k: sizes of k bits.
  std::array<SizeClass, std::numeric_limits<std::size_t>::digits + 1> classes_;
};

}  // namespace partiemc::server
