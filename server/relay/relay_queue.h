// The input queue of the relay thread: actions that other threads have posted, and messages from
// the bus.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "common/clock.h"
#include "common/mutex.h"
#include "server/relay/message_bus.h"

namespace partiemc::server {

/// Take returns all actions but only a few messages, so a flood of messages delays neither streams
/// nor a drain. Thread-safe. Held by shared_ptr, because handlers of the bus may outlive the relay.
class RelayQueue : public std::enable_shared_from_this<RelayQueue> {
 public:
  /// The kinds of messages. Each kind has its own limit of queued bytes, so a flood of fetches does
  /// not displace results.
  enum Lane : std::size_t {
    kNews,   ///< Announcements, results and answers.
    kAsked,  ///< Fetches.
  };
  static constexpr std::size_t kLanes = 2;

  /// Maximum number of messages of one lane that a call of Take returns.
  static constexpr std::size_t kMostMessages = 64;

  /// Bytes that a queued message takes in addition to its content. They count, so that a flood of
  /// empty messages is limited.
  static constexpr std::size_t kBytesOfMessage = sizeof(std::string);

  struct Work {
    std::deque<std::function<void()>> actions;
    std::array<std::deque<std::string>, kLanes> messages;
  };

  /// A message is dropped if its lane would exceed its `max_bytes`. `clock` lives during Take.
  explicit RelayQueue(std::array<std::size_t, kLanes> max_bytes, const Clock& clock = SystemClock())
      : max_bytes_(max_bytes), clock_(clock) {}

  void Post(std::function<void()> action) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Queues the messages of `subject` in `lane` from now on. Returns null if memory is exhausted.
  std::unique_ptr<MessageBus::Subscription> Listen(MessageBus& bus, const std::string& subject,
                                                   Lane lane);

  /// Moves all actions and the next messages to `work`, in order. Waits at most `patience` for the
  /// first item. Returns false if Stop was called and no action is left. Requires: `work` is empty.
  bool Take(std::chrono::milliseconds patience, Work& work);
  /// Wakes Take, and drops all further messages. Actions can still be posted.
  void Stop() ABSL_LOCKS_EXCLUDED(mutex_);

  std::uint64_t lost_messages() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  const std::array<std::size_t, kLanes> max_bytes_;
  const Clock& clock_;
  mutable Mutex mutex_;
  CondVar came_;
  Work work_ ABSL_GUARDED_BY(mutex_);
  std::array<std::size_t, kLanes> message_bytes_ ABSL_GUARDED_BY(mutex_){};
  std::uint64_t lost_messages_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace partiemc::server
