// The streams that finished a short time ago, for watchers that were disconnected at that moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>

#include "common/clock.h"
#include "common/mutex.h"
#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

/// Keeps the descriptions of finished streams, of this server and of streams that were imported
/// here, for 30 s and within 1 MiB. Thread-safe.
class FinishedStreams {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 20;

  /// Requires: `clock` outlives this.
  explicit FinishedStreams(const Clock& clock = SystemClock()) : clock_(clock) {}

  /// Adds a stream whose last result had the sequence number `last_sequence`; 0: it had no result.
  /// Drops the oldest streams if there is no room. Does not add a description above kMostBytes.
  void Add(relay::v1::LiveStream stream, std::uint64_t last_sequence) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the streams of this lineage. Called when a stream of the lineage ends without having
  /// finished: if it had resumed a finished stream, that entry is outdated.
  void Forget(std::string_view lineage) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns the stream of this name and lineage, if it finished during the last 30 s. Its summary
  /// contains the sequence number of its last result. Returns nothing for an empty lineage.
  std::optional<relay::v1::LiveStream> Find(std::string_view name, std::string_view lineage)
      ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  struct Finished {
    relay::v1::LiveStream stream;
    std::size_t bytes = 0;
    Clock::TimePoint at;
  };

  void DropOld() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  Mutex mutex_;
  std::deque<Finished> streams_ ABSL_GUARDED_BY(mutex_);  // In the order of their ends.
  std::size_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace partiemc::server
