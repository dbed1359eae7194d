#include "server/web/places.h"

#include <algorithm>
#include <unordered_map>
#include <vector>

namespace partiemc::server {

ConnectionPlaces::Place::~Place() {
  if (places_ == nullptr) return;
  const std::lock_guard lock(places_->mutex_);
  const auto found = places_->connections_.find(number_);
  if (found->second.told) --places_->told_;
  places_->connections_.erase(found);
  // With the lock held: whoever waits for the last one may take the places away after that.
  places_->left_.notify_all();
}

void ConnectionPlaces::Place::SetWaiting(bool waiting) {
  const std::lock_guard lock(places_->mutex_);
  places_->connections_.find(number_)->second.waiting = waiting;
}

std::optional<ConnectionPlaces::Place> ConnectionPlaces::Enter(std::string host, End end,
                                                               bool& gave_way) {
  std::optional<Place> place;
  End next_to_go;
  {
    const std::lock_guard lock(mutex_);
    if (Held() >= most_) next_to_go = TakeNextToGo();
    if (Held() < most_) {
      place.emplace();
      place->places_ = this;
      place->number_ = next_++;
      connections_.emplace(place->number_,
                           Connection{.host = std::move(host), .end = std::move(end)});
    }
  }
  gave_way = next_to_go != nullptr;
  if (gave_way) next_to_go();
  return place;
}

// Only where there is no place left, so that looking at all of them is quick enough.
ConnectionPlaces::End ConnectionPlaces::TakeNextToGo() {
  std::unordered_map<std::string, std::size_t> counts;
  std::size_t most = 0;
  for (const auto& [number, connection] : connections_) {
    if (connection.waiting && !connection.told) most = std::max(most, ++counts[connection.host]);
  }
  for (auto& [number, connection] : connections_) {
    if (!connection.waiting || connection.told || counts[connection.host] < most) continue;
    connection.told = true;
    ++told_;
    return connection.end;
  }
  return nullptr;
}

std::size_t ConnectionPlaces::count() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

void ConnectionPlaces::EndSome(bool all) {
  std::vector<End> ends;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, connection] : connections_) {
      if (all || connection.waiting) ends.push_back(connection.end);
    }
  }
  for (const End& end : ends) end();
}

bool ConnectionPlaces::WaitUntilEmpty(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return left_.wait_until(lock, deadline, [this] { return connections_.empty(); });
}

void ConnectionPlaces::WaitUntilEmpty() {
  std::unique_lock lock(mutex_);
  left_.wait(lock, [this] { return connections_.empty(); });
}

}  // namespace partiemc::server
