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

/// An idle worker is destroyed, with all its buffers, if for this time it has computed no frame of
/// at least a quarter of its largest frame (WarmSize). "Memory" at ComputePool has the exception.
inline constexpr std::chrono::seconds kWarmTime(10);

/// A caller competes for the threads for this time after it submitted or finished a job.
inline constexpr std::chrono::seconds kSharingTime(1);

/// The pool reacts to a shortage of memory at most once in this interval, because dropped workers
/// must allocate their buffers again.
inline constexpr std::chrono::seconds kBetweenShortages(1);

/// Runs jobs on several threads and divides the threads fairly between callers.
///
/// Order: callers take turns. Within a caller, its streams take turns; all its unary calls count as
/// one stream. A stream has at most one job in the pool. Therefore a stream delays another stream
/// of its caller by at most one frame, and a caller delays another caller by at most one job.
///
/// Threads: a caller has competitors if another caller submitted or finished a job within
/// kSharingTime and the pool has at least two threads. A caller without competitors uses all
/// threads, and its jobs share one arena. A caller with competitors runs at most `threads - 1` jobs
/// at once. So one thread stays free, and starts another caller's job as soon as it wakes. Each job
/// of a caller with competitors has a separate arena of `threads - 1` slots, so that it never waits
/// for a part of another job. A job may still wait for one job if other callers use all threads.
///
/// Memory: a job gets the worker that was used last, so a single stream always uses the same
/// worker. An idle worker is dropped if its buffers are oversized (WarmSize). Exception: all
/// workers may be needed at any time, because the streams that recently sent frames of this size
/// are at least as numerous as the workers (BusyStreams). If the budget lacks memory, idle workers
/// with bytes in the budget are dropped at once.
class ComputePool {
 public:
  using Job = std::function<void(Worker&)>;
  using Afterwards = std::function<void()>;

  /// `threads`: number of threads for all jobs together; 0 means 1. While the pool exists, this
  /// number also limits oneTBB in the whole process. `budget`: counts the memory of the workers
  /// (worker_memory.h). `observer` and `budget` outlive the pool; each may be null.
  explicit ComputePool(unsigned threads, WarmSize::Clock::duration warm_time = kWarmTime,
                       FrameObserver* observer = nullptr, MemoryBudget* budget = nullptr);
  /// Runs all submitted jobs, then joins the threads.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Queues `job`. `afterwards` runs after the job on the same thread, when the job's worker is
  /// free again. So a job that `afterwards` submits can get the same worker. Neither function may
  /// throw. `stream`: the stream of the frame, or null for a unary call; lives as long as `job`.
  /// `caller`: the caller whose turn the job uses; the pool compares the pointer and never
  /// dereferences it.
  /// `frame_bytes`: size of the frame's message. While memory is short, the job waits for the
  /// memory that such a frame usually needs (WorkerMemory::BeginFrame).
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
  // Time at which the pool last reacted to a shortage of memory. Idle workers that were created
  // before and have bytes in the budget are dropped.
  WarmSize::Clock::time_point memory_was_short_ ABSL_GUARDED_BY(mutex_){};
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;

  std::vector<std::thread> runners_;
};

}  // namespace partiemc::server
