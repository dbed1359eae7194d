// The compute threads, which all streams share.
#pragma once

#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "common/mutex.h"
#include "partiemc/arena.h"
#include "server/compute/busy_streams.h"
#include "server/compute/recent_callers.h"
#include "server/compute/round_robin.h"
#include "server/compute/worker.h"

namespace partiemc::server {

class CallerAccount;

/// A worker is dropped after its buffers have been oversized for this time.
inline constexpr std::chrono::seconds kWarmTime(10);

/// A caller counts as competing for the threads until this time has passed since its last job.
inline constexpr std::chrono::seconds kSharingTime(1);

/// Minimum interval between two times at which idle workers are dropped because memory is short.
inline constexpr std::chrono::seconds kBetweenShortages(1);

/// Runs jobs on several threads and divides these fairly between callers.
///
/// Order: callers take turns. Within a caller, its streams take turns; all its unary calls count as
/// one stream. A stream has at most one job in the pool. Therefore a stream delays another stream
/// of its caller by at most one frame, and a caller delays another caller by at most one job.
///
/// Threads: a caller without competitors uses all threads, and its jobs run their parallel parts in
/// one shared arena. A caller has competitors if another caller had a job within kSharingTime and
/// the pool has at least two threads. A caller with competitors runs at most `threads - 1` jobs at
/// once, so one thread stays free for the others. Each such job has its own arena of `threads - 1`
/// slots, so that it never waits for a part of another job. So a job of a second caller starts as
/// soon as a thread wakes. If two callers run long jobs, a third caller may wait for one job.
///
/// Memory: a job gets the worker that was used last, so a single stream always uses the same
/// worker. A worker is dropped after its buffers were oversized for `warm_time`. Exception: at
/// least as many streams as there are workers sent frames of that size recently; then all workers
/// may be needed at any time, so none is dropped. If the budget lacks memory, idle workers whose
/// bytes count in the budget are dropped at once.
class ComputePool {
 public:
  using Job = std::function<void(Worker&)>;
  using Afterwards = std::function<void()>;

  /// `threads`: number of threads for all jobs together, at least 1. While the pool exists, this
  /// number also limits oneTBB in the whole process. `budget`: counts the memory of the workers
  /// (worker_memory.h). `observer` and `budget` outlive the pool.
  explicit ComputePool(unsigned threads, WarmSize::Clock::duration warm_time = kWarmTime,
                       FrameObserver* observer = nullptr, MemoryBudget* budget = nullptr);
  /// Runs all submitted jobs, then joins the threads.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Queues `job`. `afterwards` runs after the job, when its worker is free again. So if
  /// `afterwards` submits another job, that job gets the same worker. Neither function may throw.
  /// `stream`: the stream of the frame, or null for a unary call; lives as long as `job`.
  /// `caller`: the caller whose turn the job uses; the pool compares the pointer and never
  /// dereferences it.
  /// `frame_bytes`: size of the frame's message. While memory is short, large frames are computed
  /// one after the other (WorkerMemory).
  /// Does not wait for jobs. Thread-safe; jobs may call it.
  void Submit(
      Job job, Afterwards afterwards = [] {}, BusyStreams::Mark* stream = nullptr,
      const CallerAccount* caller = nullptr, std::uint64_t frame_bytes = 0)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Number of jobs that have not begun.
  std::size_t QueueLength() const ABSL_LOCKS_EXCLUDED(mutex_);

  unsigned threads() const { return threads_; }

 private:
  struct Task {
    Job job;
    Afterwards afterwards;
    BusyStreams::Mark* stream;
    const CallerAccount* caller;  // May dangle after `job` is destroyed.
    std::uint64_t frame_bytes;
  };
  using LinesOfCaller = RoundRobin<BusyStreams::Mark*, Line<Task>>;
  using Workers = std::vector<std::unique_ptr<Worker>>;

  void Run() ABSL_LOCKS_EXCLUDED(mutex_);
  std::optional<Task> WaitForTask() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::optional<Task> NextTask() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Shares(const CallerAccount* caller) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Begin(const Task& task) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void End(const Task& task) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::unique_ptr<Worker> TakeWorker() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void PutBack(std::unique_ptr<Worker> worker, BusyStreams::Mark* stream)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void MemoryIsShort() ABSL_LOCKS_EXCLUDED(mutex_);
  Workers TakeOutlived() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Destroy(Workers workers) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const unsigned threads_;
  const WarmSize::Clock::duration warm_time_;
  FrameObserver* const observer_;
  MemoryBudget* const budget_;
  oneapi::tbb::global_control parallelism_;
  Arena arena_;
  mutable Mutex mutex_;
  CondVar task_came_;
  RoundRobin<const CallerAccount*, LinesOfCaller> tasks_ ABSL_GUARDED_BY(mutex_);
  std::size_t waiting_ ABSL_GUARDED_BY(mutex_) = 0;  // Number of tasks in tasks_.
  // The caller of each running job.
  std::vector<const CallerAccount*> running_ ABSL_GUARDED_BY(mutex_);
  RecentCallers recent_ ABSL_GUARDED_BY(mutex_);
  Workers idle_ ABSL_GUARDED_BY(mutex_);             // The last one was used last.
  std::size_t working_ ABSL_GUARDED_BY(mutex_) = 0;  // Number of workers that are not idle.
  BusyStreams busy_ ABSL_GUARDED_BY(mutex_);
  // Time at which the budget last lacked memory. Idle workers that were created before it are
  // dropped.
  WarmSize::Clock::time_point memory_was_short_ ABSL_GUARDED_BY(mutex_){};
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;

  std::vector<std::thread> runners_;
};

}  // namespace partiemc::server
