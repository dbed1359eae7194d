// The queue of the relay thread: posted actions and messages from the bus.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "server/relay/message_bus.h"

namespace partiemc::server {

/// Thread-safe. Held by shared_ptr, because handlers of the bus may outlive the relay.
class RelayQueue : public std::enable_shared_from_this<RelayQueue> {
 public:
  struct Work {
    std::deque<std::function<void()>> actions;
    std::deque<std::string> messages;
  };

  /// Drops messages while the queue holds `max_bytes`.
  explicit RelayQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void Post(std::function<void()> action);
  /// Queues the messages of `subject`. Returns null if memory is exhausted.
  std::unique_ptr<MessageBus::Subscription> Listen(MessageBus& bus, const std::string& subject);

  /// Moves all queued items to `work`, in order; waits for the first one up to `patience`. Returns
  /// false after Stop if no action is left. Requires: `work` is empty.
  bool Take(std::chrono::milliseconds patience, Work& work);
  /// Drops all further messages.
  void Stop();

  std::uint64_t lost_messages() const;

 private:
  const std::size_t max_bytes_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable came_;
  Work work_;
  std::size_t message_bytes_ = 0;
  std::uint64_t lost_messages_ = 0;
  bool stopped_ = false;
};

}  // namespace partiemc::server
