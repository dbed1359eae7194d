// The announced streams of other replicas.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "common/clock.h"
#include "common/mutex.h"
#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

struct RemoteStream {
  std::string replica;
  relay::v1::LiveStream stream;

  const std::string& id() const { return stream.summary().stream_id(); }
  const std::string& name() const { return stream.summary().stream_name(); }
};

/// The streams that other replicas have announced. Two replicas may announce the same stream: it
/// was resumed at one of them, and the other one has not ended it yet. The directory then lists the
/// stream that was opened later, according to the clocks of both replicas. Thread-safe.
class StreamDirectory {
 public:
  using TimePoint = Clock::TimePoint;

  /// Replaces the streams of a replica by the announced ones. Returns whether their ids have
  /// changed. Ignores a new replica if 1024 are known.
  bool Announced(const std::string& replica, const relay::v1::Announcement& announcement,
                 TimePoint now) ABSL_LOCKS_EXCLUDED(mutex_);
  void Left(const std::string& replica) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes and returns the replicas that have sent no announcement since `before`.
  std::vector<std::string> Expire(TimePoint before) ABSL_LOCKS_EXCLUDED(mutex_);
  /// For Expire, treats all replicas as if they had sent an announcement at `now`.
  void Refresh(TimePoint now) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Returns at most `count` distinct addresses of replicas. Omits draining replicas.
  std::vector<std::string> Addresses(std::size_t count) const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Whether every known replica has really sent an announcement since `since`.
  bool HaveAllAnnouncedSince(TimePoint since) const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Returns the stream of this name; if there are several, the one that was opened last.
  std::optional<RemoteStream> FindName(std::string_view name) const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns the stream with this lineage; if there are several, the one that was opened last.
  std::optional<RemoteStream> FindLineage(std::string_view lineage) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  bool Has(const std::string& replica, std::string_view stream_id) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns at most `count` streams for which `wants` is true, with ids above `after`, sorted by
  /// id.
  std::vector<relay::v1::LiveStream> List(
      const std::string& after, std::size_t count,
      absl::FunctionRef<bool(const relay::v1::LiveStream&)> wants) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  std::size_t replicas() const ABSL_LOCKS_EXCLUDED(mutex_);
  std::size_t streams() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  struct Replica {
    std::map<std::string, relay::v1::LiveStream> streams;  // Key: id.
    TimePoint heard, announced;
    std::string address;  // Empty: none.
  };

  template <typename Matches>
  std::optional<RemoteStream> Latest(Matches matches) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  mutable Mutex mutex_;
  std::map<std::string, Replica> replicas_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
