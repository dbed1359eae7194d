#include "server/watch/watch_registry.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/base/call_errors.h"

namespace partiemc::server {

absl::Status WatchRegistry::Enter(std::shared_ptr<WatchStateMachine> watcher) {
  const MutexLock lock(mutex_);
  if (draining_) return DrainingError();
  Add(std::move(watcher));
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
  Remove(watcher);
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
  return EndLate([&](WatchStateMachine& watcher) { return watcher.EndIfSilent(limit, now); });
}

std::chrono::steady_clock::time_point WatchRegistry::EndPaused(
    const PauseLimits& limits, std::chrono::steady_clock::time_point now) {
  return EndLate([&](WatchStateMachine& watcher) { return watcher.EndIfPaused(limits, now); });
}

void WatchRegistry::Drain(std::chrono::steady_clock::time_point patience) {
  StopAdmitting();
  for (const auto& watcher : All()) watcher->Drain();
  if (WaitUntilEmpty(patience)) return;
  for (const auto& watcher : All()) watcher->Cut();
}

}  // namespace partiemc::server
