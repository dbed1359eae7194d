#include "server/watch/result_broadcaster.h"

#include <sys/resource.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace partiemc::server {
namespace {

// Returns the number of voluntary context switches of this thread, that is, how often it had to
// wait.
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

std::vector<Published> ResultBroadcaster::BeginHistory(HistoryRoom& room, ResultBroadcaster* former,
                                                       std::uint64_t next_sequence) {
  std::vector<Published> dropped;
  std::unique_ptr<ResultHistory> history;
  if (former != nullptr) history = former->HandOver(next_sequence, dropped);
  if (history == nullptr) history = std::make_unique<ResultHistory>(room);
  std::ranges::move(history->TakeFrom(next_sequence), std::back_inserter(dropped));
  {
    const MutexLock lock(mutex_);
    history_ = std::move(history);
    if (!history_->empty()) newest_ = history_->at(history_->size() - 1);
    collected_ = published_ = newest_.number;
    NoteOldest();
  }
  room.Enter(std::shared_ptr<HistoryOwner>(shared_from_this(), this));
  if (room.is_scarce()) ShareRoom();  // The former owner can no longer do so.
  return dropped;
}

void ResultBroadcaster::HoldHistory() {
  const MutexLock lock(mutex_);
  ++history_holds_;
}

void ResultBroadcaster::ReleaseHistory() {
  {
    const MutexLock lock(mutex_);
    if (--history_holds_ > 0 || !end_ || !history_) return;
  }
  dispatcher_.Wake(*this);
}

std::unique_ptr<ResultHistory> ResultBroadcaster::HandOver(std::uint64_t next_sequence,
                                                           std::vector<Published>& dropped) {
  const MutexLock lock(mutex_);
  dropped = Collect();
  if (history_ != nullptr && !watchers_.empty()) return history_->CopyBefore(next_sequence);
  return std::move(history_);
}

bool ResultBroadcaster::Publish(std::shared_ptr<const WatchFrame> frame, std::uint64_t sequence) {
  return Post({std::move(frame), published_ + 1, sequence});
}

bool ResultBroadcaster::Post(Published published) {
  published_ = published.number;
  last_sequence_ = published.sequence;
  if (watcher_count_ != 0) {
    CountWaits([&] { mailbox_.Put(std::move(published)); });
    return true;
  }
  mailbox_.Put(std::move(published));
  // If another thread holds the lock, that thread or the next call of Publish collects this frame.
  if (mutex_.TryLock()) {
    std::vector<Published> dropped;  // Freed without the lock.
    const MutexLock lock(mutex_, std::adopt_lock);
    dropped = Collect();
  }
  // Reads the count again: a watcher that joined after the check above may have found the mailbox
  // empty, so the caller must call Announce.
  return watcher_count_ != 0;
}

void ResultBroadcaster::PublishNumbered(Published published) {
  if (Post(std::move(published))) Announce();
}

void ResultBroadcaster::Announce() {
  CountWaits([&] { dispatcher_.Wake(*this); });
}

void ResultBroadcaster::End(WatchEnd end) {
  {
    const MutexLock lock(mutex_);
    if (!end_) end_ = std::move(end);
  }
  dispatcher_.Wake(*this);
}

ResultBroadcaster::Joined ResultBroadcaster::Join(std::shared_ptr<WatchStateMachine> watcher,
                                                  std::optional<std::uint64_t> from) {
  Joined joined;
  std::vector<Published> dropped;  // Freed without the lock.
  {
    const MutexLock lock(mutex_);
    // Counts the watcher first: from now on, all published results are offered to watchers.
    ++watcher_count_;
    watchers_.push_back(std::move(watcher));
    dropped = Collect();
    joined.last_number = collected_;
    if (newest_.frame != nullptr) {
      joined.held = {.any = true, .oldest = oldest_sequence(), .newest = newest_.sequence};
    }
    const Published* const held = from && history_ ? history_->FromSequence(*from) : nullptr;
    if (held != nullptr) {
      joined.next_held = held->number;
    } else if (!from || newest_.sequence >= *from) {
      joined.first = newest_;
    }
  }
  dispatcher_.Wake(*this);
  return joined;
}

void ResultBroadcaster::Leave(const WatchStateMachine& watcher) {
  std::shared_ptr<WatchStateMachine> left;  // Released after the lock, like the frames.
  std::vector<Published> news, dropped;
  Published newest;
  const MutexLock lock(mutex_);
  const auto found = std::ranges::find_if(
      watchers_, [&](const auto& machine) { return machine.get() == &watcher; });
  if (found == watchers_.end()) return;
  left = std::move(*found);
  watchers_.erase(found);
  if (--watcher_count_ != 0) {
    if (end_ && history_) dispatcher_.Wake(*this);  // It may have been the last that goes back.
    return;
  }
  news = TakeNews();
  newest = newest_;
  dropped = Collect();
}

Published ResultBroadcaster::Held(std::uint64_t number) {
  std::vector<Published> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  if (number > collected_) dropped = Collect();  // The dispatcher may not have collected it yet.
  const Published* const held = history_ ? history_->FromNumber(number) : nullptr;
  return held != nullptr ? *held : Published();
}

Published ResultBroadcaster::HeldFrom(std::uint64_t sequence) {
  std::vector<Published> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  dropped = Collect();
  const Published* const held = history_ ? history_->FromSequence(sequence) : nullptr;
  if (held != nullptr) return *held;
  return newest_.frame != nullptr && newest_.sequence >= sequence ? newest_ : Published();
}

Published ResultBroadcaster::Newest() {
  std::vector<Published> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  dropped = Collect();
  return newest_;
}

std::uint64_t ResultBroadcaster::LastNumber() {
  std::vector<Published> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  dropped = Collect();
  return collected_;
}

std::vector<Published> ResultBroadcaster::Collect() {
  std::vector<Published> dropped;
  mailbox_.Take([&](Published published) {
    mutex_.AssertHeld();
    collected_ = published.number;
    if (history_) history_->Add(published);
    if (!watchers_.empty()) AddNews(published, dropped);
    newest_ = std::move(published);
  });
  const bool is_in_history = history_ && !history_->empty();
  if (watchers_.empty() && !is_in_history && newest_.frame != nullptr &&
      newest_.frame->bytes() > limits_.kept_bytes) {
    newest_ = {};
  }
  NoteOldest();
  return dropped;
}

void ResultBroadcaster::AddNews(const Published& published, std::vector<Published>& dropped) {
  if (!news_.empty() && news_bytes_ + published.pending_bytes() > limits_.mailbox_bytes) {
    std::ranges::move(TakeNews(), std::back_inserter(dropped));
  }
  news_.push_back(published);
  news_bytes_ += published.pending_bytes();
}

std::vector<Published> ResultBroadcaster::TakeNews() {
  news_bytes_ = 0;
  return std::exchange(news_, {});
}

void ResultBroadcaster::NoteOldest() {
  oldest_sequence_ = history_ && !history_->empty() ? history_->at(0).sequence : newest_.sequence;
}

void ResultBroadcaster::Serve() {
  std::vector<Published> news, dropped;
  std::vector<std::shared_ptr<WatchStateMachine>> watchers;
  std::optional<WatchEnd> end;
  {
    const MutexLock lock(mutex_);
    if (history_) history_->Shrink();
    dropped = Collect();
    news = TakeNews();
    watchers = watchers_;
    end = end_;
  }
  for (const auto& machine : watchers) {
    machine->Offer(news);
    if (end) machine->StreamEnded(*end);
  }
  if (end) DropHistoryUnlessRead(watchers);
}

// Drops the history of an ended stream, unless a watcher still reads it or HoldHistory keeps it.
void ResultBroadcaster::DropHistoryUnlessRead(
    const std::vector<std::shared_ptr<WatchStateMachine>>& watchers) {
  if (std::ranges::any_of(watchers, [](const auto& machine) { return machine->goes_back(); })) {
    return;
  }
  std::unique_ptr<ResultHistory> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  if (history_holds_ > 0 || watchers_ != watchers) return;
  dropped = std::move(history_);
  NoteOldest();
}

}  // namespace partiemc::server
