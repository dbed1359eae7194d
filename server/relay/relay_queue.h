// What the relay's thread is to do: what others posted, and what came over the bus.
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

/// Safe from any thread. Held by shared_ptr only: handlers of the bus may outlive the relay.
class RelayQueue : public std::enable_shared_from_this<RelayQueue> {
 public:
  struct Work {
    std::deque<std::function<void()>> actions;
    std::deque<std::string> messages;
  };

  /// Messages of more than `max_bytes` together do not wait: those that come then are lost.
  explicit RelayQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void Post(std::function<void()> action);
  /// From now on what comes to `subject` waits here. Null as MessageBus::Subscribe says.
  std::unique_ptr<MessageBus::Subscription> Listen(MessageBus& bus, const std::string& subject);

  /// Takes all that waits, in the order in which it came, into `work`, which is empty; waits for
  /// something for at most this time. False once the queue has stopped and no action is left.
  bool Take(std::chrono::milliseconds patience, Work& work);
  /// No more messages come in.
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
