// Counts the streams that were active recently. The number shows how many workers may be needed at
// once.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace partiemc::server {

/// Counts the streams that recently computed a frame of at least a given size. The count depends
/// only on the frames that were sent, not on the frames that happened to be computed at the same
/// time. Not thread-safe.
class BusyStreams {
 public:
  using Clock = std::chrono::steady_clock;

  /// The data that BusyStreams keeps about one stream. The stream owns this object.
  class Mark {
    friend class BusyStreams;
    // The last period in which the stream was counted, and the size class that counted it.
    std::int64_t period_ = std::numeric_limits<std::int64_t>::min();
    std::size_t size_class_ = 0;
  };

  /// `late`: length of a period; activity within this time counts as recent. Positive.
  explicit BusyStreams(Clock::duration late) : late_(late) {}

  /// Records that `stream` has computed a frame of `size`. `now` never decreases. Allocates
  /// nothing.
  void Worked(Mark& stream, std::size_t size, Clock::time_point now);

  /// Number of streams that computed a frame of at least `size` in the current period or in the
  /// previous one, whichever number is larger. `size` is rounded down to a power of two. Returns 0
  /// if the last such frame is older than `late`.
  std::size_t Count(std::size_t size, Clock::time_point now) const;

 private:
  struct SizeClass {
    Clock::time_point last;
    std::size_t streams = 0, streams_before = 0;  // In this period; in the previous one.
  };

  std::int64_t Period(Clock::time_point now) const { return now.time_since_epoch() / late_; }

  const Clock::duration late_;
  std::int64_t period_ = 0;  // The current period, as of the last call of Worked.
  // Class k counts sizes of k bits.
  std::array<SizeClass, std::numeric_limits<std::size_t>::digits + 1> classes_;
};

}  // namespace partiemc::server
