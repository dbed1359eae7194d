#include "server/relay/relay_queue.h"

#include <string_view>
#include <utility>

namespace partiemc::server {

void RelayQueue::Post(std::function<void()> action) {
  const std::lock_guard lock(mutex_);
  work_.actions.push_back(std::move(action));
  came_.notify_one();
}

std::unique_ptr<MessageBus::Subscription> RelayQueue::Listen(MessageBus& bus,
                                                             const std::string& subject) {
  return bus.Subscribe(subject, [queue = shared_from_this()](std::string_view message) {
    const std::lock_guard lock(queue->mutex_);
    if (queue->stopped_) return;
    if (queue->message_bytes_ + message.size() > queue->max_bytes_) {
      ++queue->lost_messages_;
      return;
    }
    queue->message_bytes_ += message.size();
    queue->work_.messages.emplace_back(message);
    queue->came_.notify_one();
  });
}

bool RelayQueue::Take(std::chrono::milliseconds patience, Work& work) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, patience,
                 [this] { return stopped_ || !work_.actions.empty() || !work_.messages.empty(); });
  if (stopped_ && work_.actions.empty()) return false;
  std::swap(work, work_);
  message_bytes_ = 0;
  return true;
}

void RelayQueue::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  came_.notify_all();
}

std::uint64_t RelayQueue::lost_messages() const {
  const std::lock_guard lock(mutex_);
  return lost_messages_;
}

}  // namespace partiemc::server
