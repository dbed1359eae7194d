// The threads that compute, shared by all streams.
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/state.h"

namespace partiemc::server {

/// What a worker keeps warm from frame to frame, whichever stream they belong to.
struct Worker {
  Workspace workspace;
  Result result;
  State next_state;  ///< Becomes the stream's state once the frame has been answered.
};

/// Runs jobs in the order in which they were submitted, several at once, all parallel parts of all
/// of them in one oneTBB arena. A stream submits its next frame only when the one before is done,
/// so that this order is a round robin over the streams that have work: a stream of large frames
/// delays every other by one of its frames at most, never by its backlog.
class ComputePool {
 public:
  using Job = std::function<void(Worker&)>;

  /// `threads` is what all jobs together may use, at least 1. While it lives, the whole process
  /// gives oneTBB no more than that.
  explicit ComputePool(unsigned threads);
  /// Runs what was submitted, then joins.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Never blocks on computing. Jobs must not throw. Safe from any thread, jobs included.
  void Submit(Job job);

  unsigned threads() const { return static_cast<unsigned>(runners_.size()); }

 private:
  void Run();

  oneapi::tbb::global_control parallelism_;
  oneapi::tbb::task_arena arena_;
  std::mutex mutex_;
  std::condition_variable job_came_;
  std::deque<Job> jobs_;   // Guarded by mutex_.
  bool stopping_ = false;  // Guarded by mutex_.
  std::vector<std::thread> runners_;
};

}  // namespace partiemc::server
