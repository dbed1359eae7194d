// Passes connections to gRPC on separate threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

namespace partiemc::server {

/// gRPC may read a connection in the thread that passes it, for as long as bytes arrive without a
/// pause. The next connection then needs another thread. Threads are started when needed, up to
/// kMostThreads; then connections wait.
class HandOverThreads {
 public:
  explicit HandOverThreads(std::function<void(int descriptor)> hand_over)
      : hand_over_(std::move(hand_over)) {}
  /// Waits until every hand-over has returned. Closes waiting connections.
  ~HandOverThreads();
  HandOverThreads(const HandOverThreads&) = delete;
  HandOverThreads& operator=(const HandOverThreads&) = delete;

  /// Thread-safe.
  void Add(int descriptor);

 private:
  static constexpr std::size_t kMostThreads = 8;

  void Run();

  const std::function<void(int)> hand_over_;
  std::mutex mutex_;  // Guards all below.
  std::condition_variable came_;
  std::queue<int> waiting_;
  std::size_t idle_ = 0;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace partiemc::server
