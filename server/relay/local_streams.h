// The open streams of this server, as the relay announces them to other replicas.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/clock.h"
#include "partiemc/relay/v1/relay.pb.h"
#include "server/relay/stream_directory.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {

/// Converts `time` to Unix time in milliseconds, which replicas can compare.
std::int64_t UnixMs(const Clock& clock, Clock::TimePoint time);

/// The streams of the registry at the last Update. Used by the relay thread only.
class LocalStreams {
 public:
  /// Requires: both references outlive this object.
  LocalStreams(const StreamRegistry& registry, const Clock& clock)
      : registry_(registry), clock_(clock) {}

  /// Lists the streams again if any was opened or closed since the last Update. Returns whether it
  /// did.
  bool Update();

  /// The broadcaster of a stream; null without such a stream.
  std::shared_ptr<ResultBroadcaster> BroadcasterOf(const std::string& stream_id) const;

  /// Whether a producer has resumed the stream of another replica here.
  bool HasTakenOver(const relay::v1::LiveStream& remote) const;

  /// Ends the watches of streams that producers have resumed at other replicas, once each.
  void EndTakenOver(const StreamDirectory& elsewhere, const WatchEnd& end);

  /// Adds the streams that are still open. Omits those opened after the last Update.
  void Announce(Clock::TimePoint now, relay::v1::Announcement& announcement) const;

 private:
  struct LocalStream {
    std::shared_ptr<ResultBroadcaster> broadcaster;
    std::string lineage;
    std::int64_t opened_unix_ms = 0;
    bool was_told = false;  // Its watches were ended, because another replica has the stream.
  };

  const StreamRegistry& registry_;
  const Clock& clock_;
  std::map<std::string, LocalStream> streams_;  // By id.
  std::uint64_t changes_ = 0;                   // Of the registry, at the last Update.
};

}  // namespace partiemc::server
