#include "server/watch/watch_registry.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/base/call_errors.h"

namespace partiemc::server {

absl::Status WatchRegistry::Enter(std::shared_ptr<WatchStateMachine> watcher) {
  const MutexLock lock(mutex_);
  if (draining_) return DrainingError();
  const WatchStateMachine* key = watcher.get();
  watchers_[key] = std::move(watcher);
  return absl::OkStatus();
}

absl::Status WatchRegistry::Open(const WatchStateMachine& watcher, const Caller& caller) {
  const MutexLock lock(mutex_);
  if (placed_.size() >= max_watchers_) {
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonTooManyWatchers), "watchers", absl::StrCat(placed_.size(), " watch"),
         absl::StrCat("must be at most ", max_watchers_,
                      "; try again when one has left, or start the server with a larger "
                      "--max-watchers")});
  }
  auto place = caller.account()->Take(CallerAccount::Kind::kWatcher);
  if (!place.ok()) return place.status();
  placed_.emplace(&watcher, *std::move(place));
  return absl::OkStatus();
}

void WatchRegistry::Close(const WatchStateMachine& watcher) {
  const MutexLock lock(mutex_);
  placed_.erase(&watcher);
}

void WatchRegistry::Leave(const WatchStateMachine& watcher) {
  const MutexLock lock(mutex_);
  placed_.erase(&watcher);
  watchers_.erase(&watcher);
  // Holds the lock, because the waiting thread may destroy the registry afterwards.
  left_.NotifyAll();
}

std::size_t WatchRegistry::count() const {
  const MutexLock lock(mutex_);
  return placed_.size();
}

std::uint64_t WatchRegistry::held_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& watcher : All()) bytes += watcher->held_bytes();
  return bytes;
}

std::chrono::steady_clock::time_point WatchRegistry::EndSilent(
    std::chrono::milliseconds limit, std::chrono::steady_clock::time_point now) {
  auto look_again = std::chrono::steady_clock::time_point::max();
  // Without the lock, because a watch that ends may call Leave.
  for (const auto& watcher : All()) {
    look_again = std::min(look_again, watcher->EndIfSilent(limit, now));
  }
  return look_again;
}

std::vector<std::shared_ptr<WatchStateMachine>> WatchRegistry::All() const {
  std::vector<std::shared_ptr<WatchStateMachine>> all;
  const MutexLock lock(mutex_);
  for (const auto& [key, watcher] : watchers_) all.push_back(watcher);
  return all;
}

// Ends the watches without the lock, because a watch that ends may call Leave.
void WatchRegistry::Drain(std::chrono::steady_clock::time_point patience) {
  {
    const MutexLock lock(mutex_);
    draining_ = true;
  }
  for (const auto& watcher : All()) watcher->Drain();
  if (WaitUntilEmpty(patience)) return;
  for (const auto& watcher : All()) watcher->Cut();
}

bool WatchRegistry::WaitUntilEmpty(std::chrono::steady_clock::time_point deadline) {
  const MutexLock lock(mutex_);
  while (!watchers_.empty() && left_.WaitUntil(mutex_, deadline)) {
  }
  return watchers_.empty();
}

}  // namespace partiemc::server
