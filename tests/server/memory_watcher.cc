#include "server/memory_watcher.h"

#include <stdexcept>
#include <utility>

namespace partiemc::server {

MemoryWatcher::MemoryWatcher(std::shared_ptr<ResultBroadcaster> broadcaster, WatchMode mode,
                             std::uint64_t credit, std::size_t max_bytes,
                             std::optional<std::uint64_t> from_sequence)
    : terms_{std::move(broadcaster), mode, credit, from_sequence},
      machine_(std::make_shared<WatchStateMachine>(static_cast<WatchTransport&>(*this), max_bytes)),
      sent_{{WatchRequest::Kind::kOpen, 0}},
      paid_(credit),
      thread_([this] { Run(); }) {
  machine_->Start();
}

MemoryWatcher::~MemoryWatcher() {
  Cancel();
  thread_.join();
}

void MemoryWatcher::Credit(std::uint64_t frames) {
  const std::lock_guard lock(mutex_);
  paid_ += frames;
  sent_.push_back({WatchRequest::Kind::kCredit, frames});
  changed_.notify_all();
}

void MemoryWatcher::Cancel() {
  {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    cut_ = true;
    changed_.notify_all();
  }
  machine_->Cancelled();
}

void MemoryWatcher::StopReading() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !writing_ || finished_; });
  taking_ = false;
}

void MemoryWatcher::WaitUntilOpened() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return opened_ || finished_; });
}

void MemoryWatcher::WaitForFrames(std::size_t count) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return seen_.size() >= count || finished_; });
}

absl::Status MemoryWatcher::status() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return finished_.has_value(); });
  return *finished_;
}

HeldFrames MemoryWatcher::held() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

bool MemoryWatcher::writes() const {
  const std::lock_guard lock(mutex_);
  return writing_;
}

std::vector<SeenFrame> MemoryWatcher::seen() const {
  const std::lock_guard lock(mutex_);
  return seen_;
}

std::string MemoryWatcher::end_reason() const {
  const std::lock_guard lock(mutex_);
  return end_reason_;
}

std::uint64_t MemoryWatcher::end_dropped() const {
  const std::lock_guard lock(mutex_);
  return end_dropped_;
}

std::uint64_t MemoryWatcher::unpaid() const {
  const std::lock_guard lock(mutex_);
  return unpaid_;
}

void MemoryWatcher::StartRead() {
  const std::lock_guard lock(mutex_);
  if (reading_ || finished_) throw std::logic_error("two reads at once, or one after the end");
  reading_ = true;
  changed_.notify_all();
}

void MemoryWatcher::BeginWrite() {
  if (writing_ || finished_) throw std::logic_error("two writes at once, or one after the end");
  writing_ = true;
  changed_.notify_all();
}

void MemoryWatcher::WriteOpened(const HeldFrames& held) {
  const std::lock_guard lock(mutex_);
  opened_ = true;
  held_ = held;
  BeginWrite();
}

void MemoryWatcher::WriteFrame(const Published& published, std::uint64_t dropped,
                               std::uint64_t /*oldest_sequence*/) {
  const std::lock_guard lock(mutex_);
  BeginWrite();
  seen_.push_back({published.sequence, dropped});
  if (paid_ == 0) {
    ++unpaid_;
  } else {
    --paid_;
  }
}

void MemoryWatcher::WriteEnded(const WatchEnd& end, std::uint64_t dropped) {
  const std::lock_guard lock(mutex_);
  BeginWrite();
  end_reason_ = end.reason;
  end_dropped_ = dropped;
}

void MemoryWatcher::Cut() {
  const std::lock_guard lock(mutex_);
  cut_ = true;
  changed_.notify_all();
}

void MemoryWatcher::Finish(const absl::Status& status) {
  const std::lock_guard lock(mutex_);
  if (finished_ || writing_) throw std::logic_error("finished twice, or while writing");
  finished_ = status;
  changed_.notify_all();
}

void MemoryWatcher::Run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto written = [this] { return writing_ && (taking_ || cut_); };
    const auto read = [this] { return reading_ && !sent_.empty(); };
    changed_.wait(lock, [&] { return finished_ || written() || read(); });
    if (finished_) return;
    if (written()) {
      writing_ = false;
      const bool ok = !cut_;
      changed_.notify_all();
      lock.unlock();
      machine_->WriteDone(ok);
    } else {
      reading_ = false;
      const WatchRequest request = sent_.front();
      sent_.pop_front();
      lock.unlock();
      machine_->ReadDone(request);
    }
    lock.lock();
  }
}

}  // namespace partiemc::server
