#include "server/relay/local_streams.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>

#include "server/relay/stream_summary.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kAllStreams = std::numeric_limits<std::size_t>::max();

}  // namespace

std::int64_t UnixMs(const Clock& clock, Clock::TimePoint time) {
  const auto ago =
      std::chrono::duration_cast<std::chrono::system_clock::duration>(clock.Now() - time);
  return std::chrono::floor<std::chrono::milliseconds>((clock.TimeOfDay() - ago).time_since_epoch())
      .count();
}

bool LocalStreams::Update() {
  if (registry_.changes() == changes_) return false;
  changes_ = registry_.changes();
  std::map<std::string, LocalStream> streams;
  for (const StreamSummary& stream : registry_.List(0, kAllStreams)) {
    const auto known = streams_.find(stream.id);
    streams[stream.id] = known != streams_.end()
                             ? known->second
                             : LocalStream{.broadcaster = stream.description.broadcaster,
                                           .lineage = stream.lineage,
                                           .opened_unix_ms = UnixMs(clock_, stream.opened)};
  }
  streams_.swap(streams);
  return true;
}

std::shared_ptr<ResultBroadcaster> LocalStreams::BroadcasterOf(const std::string& stream_id) const {
  const auto found = streams_.find(stream_id);
  return found == streams_.end() ? nullptr : found->second.broadcaster;
}

bool LocalStreams::HasTakenOver(const relay::v1::LiveStream& remote) const {
  return std::ranges::any_of(streams_, [&](const auto& item) {
    return item.second.lineage == remote.lineage() &&
           item.second.opened_unix_ms > remote.opened_unix_ms();
  });
}

void LocalStreams::EndTakenOver(const StreamDirectory& elsewhere, const WatchEnd& end) {
  for (auto& [id, local] : streams_) {
    if (local.was_told) continue;
    const auto resumed = elsewhere.FindLineage(local.lineage);
    if (!resumed || resumed->stream.opened_unix_ms() <= local.opened_unix_ms) continue;
    local.was_told = true;
    local.broadcaster->End(end);
  }
}

void LocalStreams::Announce(Clock::TimePoint now, relay::v1::Announcement& announcement) const {
  for (const StreamSummary& stream : registry_.List(0, kAllStreams)) {
    const auto found = streams_.find(stream.id);
    if (found == streams_.end()) continue;
    relay::v1::LiveStream& live = *announcement.add_streams();
    EncodeSummary(stream, now, *live.mutable_summary());
    live.set_lineage(stream.lineage);
    live.set_opened_unix_ms(found->second.opened_unix_ms);
  }
}

}  // namespace partiemc::server
