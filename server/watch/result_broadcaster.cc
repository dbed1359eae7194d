#include "server/watch/result_broadcaster.h"

#include <sys/resource.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace partiemc::server {
namespace {

// How often this thread has given up its processor to wait for something.
long Sleeps() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

}  // namespace

ResultBroadcaster::ResultBroadcaster(WatchDispatcher& dispatcher, const Limits& limits)
    : dispatcher_(dispatcher), limits_(limits), mailbox_(limits.mailbox_bytes) {}

template <typename Action>
void ResultBroadcaster::CountWaits(Action action) {
  const long sleeps = Sleeps();
  action();
  if (Sleeps() != sleeps) ++producer_waits_;
}

bool ResultBroadcaster::Publish(std::shared_ptr<const WatchFrame> frame) {
  ++published_;
  if (watcher_count_ == 0) {
    if (frame->bytes() <= limits_.kept_bytes) {
      mailbox_.Put({std::move(frame), published_}, /*keep_older=*/false);
    } else {
      mailbox_.Clear();
    }
    // Who has joined meanwhile may have found the mailbox empty.
    return watcher_count_ != 0;
  }
  CountWaits([&] { mailbox_.Put({std::move(frame), published_}, /*keep_older=*/true); });
  return true;
}

void ResultBroadcaster::Announce() {
  CountWaits([&] { dispatcher_.Wake(*this); });
}

void ResultBroadcaster::End(WatchEnd end) {
  {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = std::move(end);
  }
  dispatcher_.Wake(*this);
}

void ResultBroadcaster::Join(std::shared_ptr<WatchStateMachine> watcher) {
  {
    const std::lock_guard lock(mutex_);
    // From here on the mailbox keeps everything.
    ++watcher_count_;
    TakeNews();
    watchers_.push_back({.machine = std::move(watcher), .first = newest_});
  }
  dispatcher_.Wake(*this);
}

void ResultBroadcaster::Leave(const WatchStateMachine& watcher) {
  Entry left;  // Given up without the lock, and so are the frames.
  std::vector<Published> news;
  Published newest;
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(
      watchers_, [&](const Entry& entry) { return entry.machine.get() == &watcher; });
  if (found == watchers_.end()) return;
  left = std::move(*found);
  watchers_.erase(found);
  if (--watcher_count_ != 0) return;
  news = std::exchange(news_, {});
  newest = std::exchange(newest_, {});
  if (newest.frame != nullptr && newest.frame->bytes() <= limits_.kept_bytes) {
    mailbox_.PutBack(std::move(newest));
  }
}

void ResultBroadcaster::TakeNews() {
  std::vector<Published> news = mailbox_.Take();
  if (news.empty()) return;
  newest_ = news.back();
  news_.insert(news_.end(), std::make_move_iterator(news.begin()),
               std::make_move_iterator(news.end()));
}

void ResultBroadcaster::Serve() {
  std::vector<Published> news;
  std::vector<Entry> watchers;
  std::optional<WatchEnd> end;
  {
    const std::lock_guard lock(mutex_);
    if (watchers_.empty()) return;
    TakeNews();
    news = std::exchange(news_, {});
    watchers = watchers_;
    for (Entry& entry : watchers_) entry.first = {};
    end = end_;
  }
  for (const Entry& entry : watchers) {
    if (entry.first.frame != nullptr) entry.machine->Offer({&entry.first, 1});
    entry.machine->Offer(news);
    if (end) entry.machine->StreamEnded(*end);
  }
}

}  // namespace partiemc::server
