#include "server/watch/watch_hub.h"

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

WatchHub::WatchHub(WatchPump& pump, const Limits& limits)
    : pump_(pump), limits_(limits), tap_(limits.tap_bytes) {}

template <typename Action>
void WatchHub::CountWaits(Action action) {
  const long sleeps = Sleeps();
  action();
  if (Sleeps() != sleeps) ++producer_waits_;
}

bool WatchHub::Publish(std::shared_ptr<const WatchFrame> frame) {
  ++published_;
  if (watcher_count_ == 0) {
    if (frame->bytes() <= limits_.kept_bytes) {
      tap_.Put({std::move(frame), published_}, /*keep_older=*/false);
    } else {
      tap_.Clear();
    }
    // Who has joined meanwhile may have found the tap empty.
    return watcher_count_ != 0;
  }
  CountWaits([&] { tap_.Put({std::move(frame), published_}, /*keep_older=*/true); });
  return true;
}

void WatchHub::Announce() {
  CountWaits([&] { pump_.Wake(*this); });
}

void WatchHub::End(WatchEnd end) {
  {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = std::move(end);
  }
  pump_.Wake(*this);
}

void WatchHub::Join(std::shared_ptr<WatchFlow> watcher) {
  {
    const std::lock_guard lock(mutex_);
    // From here on the tap keeps everything.
    ++watcher_count_;
    TakeNews();
    watchers_.push_back({.flow = std::move(watcher), .first = newest_});
  }
  pump_.Wake(*this);
}

void WatchHub::Leave(const WatchFlow& watcher) {
  Entry left;  // Given up without the lock, and so are the frames.
  std::vector<Published> news;
  Published newest;
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(
      watchers_, [&](const Entry& entry) { return entry.flow.get() == &watcher; });
  if (found == watchers_.end()) return;
  left = std::move(*found);
  watchers_.erase(found);
  if (--watcher_count_ != 0) return;
  news = std::exchange(news_, {});
  newest = std::exchange(newest_, {});
  if (newest.frame != nullptr && newest.frame->bytes() <= limits_.kept_bytes) {
    tap_.PutBack(std::move(newest));
  }
}

void WatchHub::TakeNews() {
  std::vector<Published> news = tap_.Take();
  if (news.empty()) return;
  newest_ = news.back();
  news_.insert(news_.end(), std::make_move_iterator(news.begin()),
               std::make_move_iterator(news.end()));
}

void WatchHub::Serve() {
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
    if (entry.first.frame != nullptr) entry.flow->Offer({&entry.first, 1});
    entry.flow->Offer(news);
    if (end) entry.flow->StreamEnded(*end);
  }
}

}  // namespace partiemc::server
