// Queues the work of the relay's thread: actions of this server, and messages of the bus.
#pragma once

#include <array>
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

/// Actions are taken all at once, and messages in small numbers, so that a flood on the bus delays
/// no stream and no drain. Safe from any thread. Held by shared_ptr only: handlers of the bus may
/// outlive the relay.
class RelayQueue : public std::enable_shared_from_this<RelayQueue> {
 public:
  /// Messages whose senders are bounded apart from each other.
  enum Lane : std::size_t {
    kNews,   ///< Announcements, results and answers.
    kAsked,  ///< Fetches.
  };
  static constexpr std::size_t kLanes = 2;

  /// Messages of one lane that Take takes at a time.
  static constexpr std::size_t kMostMessages = 64;

  struct Work {
    std::deque<std::function<void()>> actions;
    std::array<std::deque<std::string>, kLanes> messages;
  };

  /// Messages of a lane beyond its `max_bytes` are lost.
  explicit RelayQueue(std::array<std::size_t, kLanes> max_bytes) : max_bytes_(max_bytes) {}

  void Post(std::function<void()> action);
  /// Queues the messages of `subject` from now on. Null as MessageBus::Subscribe says.
  std::unique_ptr<MessageBus::Subscription> Listen(MessageBus& bus, const std::string& subject,
                                                   Lane lane);

  /// Takes all actions and the next messages, in the order in which they came, into `work`, which
  /// is empty. Waits at most `patience` for work. False once the queue has stopped and no action is
  /// left.
  bool Take(std::chrono::milliseconds patience, Work& work);
  /// No more messages come in.
  void Stop();

  std::uint64_t lost_messages() const;

 private:
  const std::array<std::size_t, kLanes> max_bytes_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable came_;
  Work work_;
  std::array<std::size_t, kLanes> message_bytes_{};
  std::uint64_t lost_messages_ = 0;
  bool stopped_ = false;
};

}  // namespace partiemc::server
