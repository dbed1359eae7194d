// Hands connections to gRPC on threads of its own.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

namespace partiemc::server {

/// gRPC may read a connection in the thread that hands it over, for as long as bytes arrive without
/// a pause. Then the next connection takes another thread. Threads are started when needed, up to a
/// limit; beyond it connections wait.
class HandOverThreads {
 public:
  explicit HandOverThreads(std::function<void(int descriptor)> hand_over)
      : hand_over_(std::move(hand_over)) {}
  /// Waits until every hand-over has returned. Connections that still wait are closed.
  ~HandOverThreads();
  HandOverThreads(const HandOverThreads&) = delete;
  HandOverThreads& operator=(const HandOverThreads&) = delete;

  /// Safe from any thread.
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
