#include "server/relay/relay_queue.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace partiemc::server {

void RelayQueue::Post(std::function<void()> action) {
  const MutexLock lock(mutex_);
  work_.actions.push_back(std::move(action));
  came_.NotifyOne();
}

std::unique_ptr<MessageBus::Subscription> RelayQueue::Listen(MessageBus& bus,
                                                             const std::string& subject,
                                                             Lane lane) {
  return bus.Subscribe(subject, [queue = shared_from_this(), lane](std::string_view message) {
    const MutexLock lock(queue->mutex_);
    if (queue->stopped_) return;
    const std::size_t bytes = message.size() + kBytesOfMessage;
    if (queue->message_bytes_[lane] + bytes > queue->max_bytes_[lane]) {
      ++queue->lost_messages_;
      return;
    }
    queue->message_bytes_[lane] += bytes;
    queue->work_.messages[lane].emplace_back(message);
    queue->came_.NotifyOne();
  });
}

bool RelayQueue::Take(std::chrono::milliseconds patience, Work& work) {
  const auto deadline = clock_.Now() + patience;
  const MutexLock lock(mutex_);
  while (!stopped_ && work_.actions.empty() &&
         std::ranges::all_of(work_.messages, &std::deque<std::string>::empty) &&
         clock_.WaitUntil(came_, mutex_, deadline)) {
  }
  if (stopped_ && work_.actions.empty()) return false;
  std::swap(work.actions, work_.actions);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    auto& waiting = work_.messages[lane];
    for (std::size_t k = 0; k < kMostMessages && !waiting.empty(); ++k) {
      message_bytes_[lane] -= waiting.front().size() + kBytesOfMessage;
      work.messages[lane].push_back(std::move(waiting.front()));
      waiting.pop_front();
    }
  }
  return true;
}

void RelayQueue::Stop() {
  const MutexLock lock(mutex_);
  stopped_ = true;
  came_.NotifyAll();
}

std::uint64_t RelayQueue::lost_messages() const {
  const MutexLock lock(mutex_);
  return lost_messages_;
}

}  // namespace partiemc::server
