#include "server/connections/connection_table.h"

#include <utility>

namespace partiemc::server {

CallTally::CallTally(std::shared_ptr<TrackedConnection> connection)
    : connection_(std::move(connection)) {
  if (connection_ != nullptr) connection_->ledger.OnCallBegun();
}

CallTally::~CallTally() {
  if (connection_ != nullptr) connection_->ledger.OnCallEnded(reading_);
}

void CallTally::OnReadBegun() {
  if (connection_ == nullptr) return;
  reading_ = true;
  connection_->ledger.OnReadBegun();
}

void CallTally::OnReadDone(std::uint64_t bytes) {
  if (connection_ == nullptr) return;
  reading_ = false;
  connection_->ledger.OnReadDone(bytes);
}

bool ConnectionTable::Add(const std::string& peer, std::shared_ptr<TrackedConnection> connection) {
  const MutexLock lock(mutex_);
  return connections_.try_emplace(peer, std::move(connection)).second;
}

void ConnectionTable::Remove(const std::string& peer) {
  const MutexLock lock(mutex_);
  connections_.erase(peer);
}

std::shared_ptr<TrackedConnection> ConnectionTable::BeginCall(std::string_view peer,
                                                              CallKind kind) const {
  std::shared_ptr<TrackedConnection> connection;
  {
    const MutexLock lock(mutex_);
    auto found = connections_.find(peer);
    if (found == connections_.end() && peer.starts_with("ipv6:")) {
      found = connections_.find(NormalPeer(peer));
    }
    if (found == connections_.end()) return nullptr;
    connection = found->second;
  }
  if (kind == CallKind::kOther && connection->admission == Admission::kHealthOnly) {
    connection->misused = true;
  }
  return connection;
}

std::string NormalPeer(std::string_view peer) {
  if (!peer.starts_with("ipv6:")) return std::string(peer);
  std::string text(peer);
  for (const auto& [escaped, character] : {std::pair("%5B", "["), std::pair("%5D", "]")}) {
    if (const auto at = text.find(escaped); at != text.npos) text.replace(at, 3, character);
  }
  const auto zone = text.find('%'), end = text.find(']');
  if (zone < end && end != std::string::npos) text.erase(zone, end - zone);
  return text;
}

}  // namespace partiemc::server
