#include "server/relay/stream_directory.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/address.h"

namespace partiemc::server {
namespace {

// Limits the memory of announcements. Further replicas are ignored.
constexpr std::size_t kMaxReplicas = 1024;

// Returns the address at which a replica accepts streams; empty if it drains or has no TCP address.
std::string AddressOf(const relay::v1::Announcement& announcement) {
  const auto address = ParseAddress(announcement.address());
  const bool can_be_reached = address.ok() && address->unix_path.empty() && address->port != 0;
  return can_be_reached && !announcement.draining() ? announcement.address() : "";
}

}  // namespace

bool StreamDirectory::Announced(const std::string& replica,
                                const relay::v1::Announcement& announcement, TimePoint now) {
  std::map<std::string, relay::v1::LiveStream> streams;
  for (const auto& stream : announcement.streams()) {
    streams.insert_or_assign(stream.summary().stream_id(), stream);
  }
  const MutexLock lock(mutex_);
  if (replicas_.size() >= kMaxReplicas && !replicas_.contains(replica)) return false;
  Replica& known = replicas_[replica];
  known.heard = known.announced = now;
  known.address = AddressOf(announcement);
  known.streams.swap(streams);
  return !std::ranges::equal(
      known.streams, streams, {}, [](const auto& item) { return item.first; },
      [](const auto& item) { return item.first; });
}

void StreamDirectory::Left(const std::string& replica) {
  const MutexLock lock(mutex_);
  replicas_.erase(replica);
}

std::vector<std::string> StreamDirectory::Expire(TimePoint before) {
  std::vector<std::string> gone;
  const MutexLock lock(mutex_);
  for (auto it = replicas_.begin(); it != replicas_.end();) {
    if (it->second.heard >= before) {
      ++it;
      continue;
    }
    gone.push_back(it->first);
    it = replicas_.erase(it);
  }
  return gone;
}

void StreamDirectory::Refresh(TimePoint now) {
  const MutexLock lock(mutex_);
  for (auto& [name, replica] : replicas_) replica.heard = now;
}

std::vector<std::string> StreamDirectory::Addresses(std::size_t count) const {
  std::set<std::string> addresses;
  const MutexLock lock(mutex_);
  for (const auto& [name, replica] : replicas_) {
    if (!replica.address.empty() && addresses.size() < count) addresses.insert(replica.address);
  }
  return {addresses.begin(), addresses.end()};
}

bool StreamDirectory::HaveAllAnnouncedSince(TimePoint since) const {
  const MutexLock lock(mutex_);
  return std::ranges::all_of(replicas_,
                             [since](const auto& item) { return item.second.announced >= since; });
}

template <typename Matches>
std::optional<RemoteStream> StreamDirectory::Latest(Matches matches) const {
  std::optional<RemoteStream> latest;
  for (const auto& [name, replica] : replicas_) {
    for (const auto& [id, stream] : replica.streams) {
      if (!matches(stream)) continue;
      if (latest && latest->stream.opened_unix_ms() >= stream.opened_unix_ms()) continue;
      latest = RemoteStream{name, stream};
    }
  }
  return latest;
}

std::optional<RemoteStream> StreamDirectory::FindName(std::string_view name) const {
  const MutexLock lock(mutex_);
  return Latest([name](const auto& stream) { return stream.summary().stream_name() == name; });
}

std::optional<RemoteStream> StreamDirectory::FindLineage(std::string_view lineage) const {
  const MutexLock lock(mutex_);
  return Latest([lineage](const auto& stream) { return stream.lineage() == lineage; });
}

bool StreamDirectory::Has(const std::string& replica, std::string_view stream_id) const {
  const MutexLock lock(mutex_);
  const auto found = replicas_.find(replica);
  return found != replicas_.end() && found->second.streams.contains(std::string(stream_id));
}

std::vector<relay::v1::LiveStream> StreamDirectory::List(
    const std::string& after, std::size_t count,
    absl::FunctionRef<bool(const relay::v1::LiveStream&)> wants) const {
  std::map<std::string, const relay::v1::LiveStream*> latest;  // Key: lineage.
  const MutexLock lock(mutex_);
  for (const auto& [name, replica] : replicas_) {
    for (const auto& [id, stream] : replica.streams) {
      if (!wants(stream)) continue;
      const auto [it, is_new] = latest.emplace(stream.lineage(), &stream);
      if (!is_new && it->second->opened_unix_ms() < stream.opened_unix_ms()) it->second = &stream;
    }
  }
  std::map<std::string, const relay::v1::LiveStream*> in_order;
  for (const auto& [lineage, stream] : latest) {
    if (stream->summary().stream_id() > after) in_order[stream->summary().stream_id()] = stream;
  }
  std::vector<relay::v1::LiveStream> streams;
  for (const auto& [id, stream] : in_order) {
    if (streams.size() == count) break;
    streams.push_back(*stream);
  }
  return streams;
}

std::size_t StreamDirectory::replicas() const {
  const MutexLock lock(mutex_);
  return replicas_.size();
}

std::size_t StreamDirectory::streams() const {
  const MutexLock lock(mutex_);
  std::size_t streams = 0;
  for (const auto& [name, replica] : replicas_) streams += replica.streams.size();
  return streams;
}

}  // namespace partiemc::server
