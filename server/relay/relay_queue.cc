#include "server/relay/relay_queue.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace partiemc::server {

void RelayQueue::Post(std::function<void()> action) {
  const std::lock_guard lock(mutex_);
  work_.actions.push_back(std::move(action));
  came_.notify_one();
}

std::unique_ptr<MessageBus::Subscription> RelayQueue::Listen(MessageBus& bus,
                                                             const std::string& subject,
                                                             Lane lane) {
  return bus.Subscribe(subject, [queue = shared_from_this(), lane](std::string_view message) {
    const std::lock_guard lock(queue->mutex_);
    if (queue->stopped_) return;
    if (queue->message_bytes_[lane] + message.size() > queue->max_bytes_[lane]) {
      ++queue->lost_messages_;
      return;
    }
    queue->message_bytes_[lane] += message.size();
    queue->work_.messages[lane].emplace_back(message);
    queue->came_.notify_one();
  });
}

bool RelayQueue::Take(std::chrono::milliseconds patience, Work& work) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, patience, [this] {
    return stopped_ || !work_.actions.empty() ||
           !std::ranges::all_of(work_.messages, &std::deque<std::string>::empty);
  });
  if (stopped_ && work_.actions.empty()) return false;
  std::swap(work.actions, work_.actions);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    auto& waiting = work_.messages[lane];
    for (std::size_t k = 0; k < kMostMessages && !waiting.empty(); ++k) {
      message_bytes_[lane] -= waiting.front().size();
      work.messages[lane].push_back(std::move(waiting.front()));
      waiting.pop_front();
    }
  }
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
