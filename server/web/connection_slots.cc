#include "server/web/connection_slots.h"

#include <algorithm>
#include <vector>

namespace partiemc::server {

ConnectionSlots::Slot::~Slot() {
  if (slots_ == nullptr) return;
  const MutexLock lock(slots_->mutex_);
  const auto found = slots_->connections_.find(number_);
  if (!found->second.evicted) slots_->Uncount(found->second);
  slots_->connections_.erase(found);
  // Holds the lock, because the waiting thread may destroy this object afterwards.
  slots_->left_.NotifyAll();
}

void ConnectionSlots::Slot::SetState(State state) {
  const MutexLock lock(slots_->mutex_);
  slots_->connections_.find(number_)->second.state = state;
}

ConnectionSlots::Slot ConnectionSlots::Enter(const std::string& address, End end, bool& evicted) {
  Slot slot;
  End end_other;
  {
    const MutexLock lock(mutex_);
    const bool address_is_full = CountOf(address) >= limits_.per_address;
    const bool is_full = address_is_full || held_ >= limits_.connections;
    Connection* other =
        is_full ? NextToEvict(false, address_is_full ? &address : nullptr) : nullptr;
    slot.reserved_ = is_full && other == nullptr;
    if (slot.reserved_ && held_reserved_ >= limits_.reserved) other = NextToEvict(true, nullptr);
    if (other != nullptr) {
      other->evicted = true;
      Uncount(*other);
      end_other = other->end;
    }
    slot.slots_ = this;
    slot.number_ = next_++;
    const auto [entered, is_new] = connections_.emplace(
        slot.number_,
        Connection{.address = address, .end = std::move(end), .reserved = slot.reserved_});
    Count(entered->second);
  }
  evicted = end_other != nullptr;
  if (evicted) end_other();
  return slot;
}

// Selects the idle connection to evict. Takes linear time in the number of connections, but is
// called only if no slot is free.
ConnectionSlots::Connection* ConnectionSlots::NextToEvict(bool reserved,
                                                          const std::string* address) {
  const auto may_go = [&](const Connection& connection) {
    return connection.state != State::kServed && !connection.evicted &&
           connection.reserved == reserved &&
           (address == nullptr || connection.address == *address);
  };
  std::unordered_map<std::string, std::size_t> counts;
  std::size_t most = 0;
  for (const auto& [number, connection] : connections_) {
    if (may_go(connection)) most = std::max(most, ++counts[connection.address]);
  }
  for (auto& [number, connection] : connections_) {
    if (may_go(connection) && counts[connection.address] == most) return &connection;
  }
  return nullptr;
}

void ConnectionSlots::Count(const Connection& connection) {
  ++(connection.reserved ? held_reserved_ : held_);
  if (!connection.reserved) ++held_by_[connection.address];
}

void ConnectionSlots::Uncount(const Connection& connection) {
  --(connection.reserved ? held_reserved_ : held_);
  if (connection.reserved) return;
  const auto found = held_by_.find(connection.address);
  if (--found->second == 0) held_by_.erase(found);
}

std::size_t ConnectionSlots::CountOf(const std::string& address) const {
  const auto found = held_by_.find(address);
  return found == held_by_.end() ? 0 : found->second;
}

std::size_t ConnectionSlots::count() const {
  const MutexLock lock(mutex_);
  return connections_.size();
}

void ConnectionSlots::EndSome(bool all) {
  std::vector<End> ends;
  {
    const MutexLock lock(mutex_);
    for (const auto& [number, connection] : connections_) {
      if (all || connection.state == State::kNoCall) ends.push_back(connection.end);
    }
  }
  for (const End& end : ends) end();
}

bool ConnectionSlots::WaitUntilEmpty(std::chrono::steady_clock::time_point deadline) {
  const MutexLock lock(mutex_);
  while (!connections_.empty() && left_.WaitUntil(mutex_, deadline)) {
  }
  return connections_.empty();
}

void ConnectionSlots::WaitUntilEmpty() {
  const MutexLock lock(mutex_);
  while (!connections_.empty()) left_.Wait(mutex_);
}

}  // namespace partiemc::server
