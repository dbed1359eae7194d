// Passes connections to gRPC on separate threads.
#pragma once

#include <cstddef>
#include <functional>
#include <queue>
#include <thread>
#include <vector>

#include "common/mutex.h"

namespace partiemc::server {

/// Threads that pass connections to gRPC. The thread that passes a connection may have to read it
/// for gRPC while bytes arrive without a pause. The next connection then needs another thread.
/// Threads are started on demand, up to kMostThreads; if all are busy, connections wait.
class HandOverThreads {
 public:
  explicit HandOverThreads(std::function<void(int descriptor)> hand_over)
      : hand_over_(std::move(hand_over)) {}
  /// Waits until every call of the hand-over function has returned. Closes the connections that
  /// still wait.
  ~HandOverThreads();
  HandOverThreads(const HandOverThreads&) = delete;
  HandOverThreads& operator=(const HandOverThreads&) = delete;

  /// Takes over `descriptor`. Thread-safe; does not wait for the hand-over.
  void Add(int descriptor) ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  static constexpr std::size_t kMostThreads = 8;

  void Run();

  const std::function<void(int)> hand_over_;
  Mutex mutex_;
  CondVar came_;
  std::queue<int> waiting_ ABSL_GUARDED_BY(mutex_);
  std::size_t idle_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stop_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
