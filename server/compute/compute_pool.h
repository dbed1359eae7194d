// The threads that compute, shared by all streams.
#pragma once

#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "partiemc/arena.h"
#include "server/compute/busy_streams.h"
#include "server/compute/recent_callers.h"
#include "server/compute/round_robin.h"
#include "server/compute/worker.h"

namespace partiemc::server {

class CallerAccount;

/// For how long a worker keeps buffers that it has no use for.
inline constexpr std::chrono::seconds kWarmTime(10);

/// For how long after its last job a caller counts as one who shares the threads.
inline constexpr std::chrono::seconds kSharingTime(1);

/// Want of memory takes idle workers their buffers this often at most.
inline constexpr std::chrono::seconds kBetweenShortages(1);

/// Runs jobs, several at once. Callers take turns, and of a caller its streams, of which each has
/// one job at a time, and the line of all its jobs that are of no stream. So a stream of large
/// frames delays every other by one of its frames at most, never by its backlog; calls without a
/// stream delay it by one of them, however many wait; and a caller delays others by one job,
/// however many streams and calls it has.
///
/// A caller alone has all threads, and all parallel parts of its jobs are in one arena. Where
/// others have had jobs within kSharingTime, one thread stays free of it, if there is more than
/// one: it has one job less at a time, and each of its jobs one place less, in an arena of its own,
/// where nobody else's pieces are waited for. So jobs of one caller, however long, delay another's
/// by no more than it takes to wake a thread. Two callers with long jobs can still do so for one
/// job.
///
/// Memory: a job gets the worker that was used last, so that one stream keeps one of them warm,
/// however many threads there are. A worker that for `warm_time` has had no frame of at least a
/// quarter of its largest is dropped with all of its buffers: after a large frame an idle server,
/// or one with small frames, soon holds no more than it needs. It stays where as many streams as
/// there are workers send such frames: how often these meet is luck, and may change by the minute,
/// but they can at any time. What is free of the process's memory goes back to the system whenever
/// a worker is dropped, and every `warm_time` while there is work: what requests and answers needed
/// at some moment, and the gaps that they left, do not add up. Where the budget has no room for
/// somebody, idle workers that hold some of it are dropped at once.
class ComputePool {
 public:
  using Job = std::function<void(Worker&)>;
  using Afterwards = std::function<void()>;

  /// `threads` is what all jobs together may use, at least 1. While it lives, the whole process
  /// gives oneTBB no more than that.
  /// `observer` and `budget`, in which the memory of workers counts (worker_memory.h), outlive the
  /// pool.
  explicit ComputePool(unsigned threads, WarmSize::Clock::duration warm_time = kWarmTime,
                       FrameObserver* observer = nullptr, MemoryBudget* budget = nullptr);
  /// Runs what was submitted, then joins.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Runs `job`, then `afterwards`, which has no worker any more: what it submits gets the same
  /// one. `stream` is of the stream whose frame it is, if any, and lives as long as `job`; `caller`
  /// is whose turn it takes, and no more than that. `frame_bytes` is the size of the frame's
  /// message: while memory is short, large frames are computed one after the other (WorkerMemory).
  /// Never blocks on computing. Neither may throw. Safe from any thread, jobs included.
  void Submit(
      Job job, Afterwards afterwards = [] {}, BusyStreams::Mark* stream = nullptr,
      const CallerAccount* caller = nullptr, std::uint64_t frame_bytes = 0);

  /// Jobs that have been submitted and not begun.
  std::size_t QueueLength() const;

  unsigned threads() const { return threads_; }

 private:
  struct Task {
    Job job;
    Afterwards afterwards;
    BusyStreams::Mark* stream;
    const CallerAccount* caller;  // May be gone once `job` is.
    std::uint64_t frame_bytes;
  };
  using LinesOfCaller = RoundRobin<BusyStreams::Mark*, Line<Task>>;
  using Workers = std::vector<std::unique_ptr<Worker>>;

  void Run();
  // With the lock held; those that get it let it go for a while:
  std::optional<Task> WaitForTask(std::unique_lock<std::mutex>& lock);
  std::optional<Task> NextTask();
  bool Shares(const CallerAccount* caller) const;
  void Begin(const Task& task);
  void End(const Task& task);
  std::unique_ptr<Worker> TakeWorker();
  void PutBack(std::unique_ptr<Worker> worker, BusyStreams::Mark* stream);
  void MemoryIsShort();
  Workers TakeOutlived();
  void GiveBack(Workers workers, bool due, std::unique_lock<std::mutex>& lock);

  const unsigned threads_;
  const WarmSize::Clock::duration warm_time_;
  FrameObserver* const observer_;
  MemoryBudget* const budget_;
  oneapi::tbb::global_control parallelism_;
  Arena arena_;
  mutable std::mutex mutex_;
  std::condition_variable task_came_;
  // Guarded by mutex_:
  RoundRobin<const CallerAccount*, LinesOfCaller> tasks_;
  std::size_t waiting_ = 0;                    // Of tasks_.
  std::vector<const CallerAccount*> running_;  // Whose jobs are.
  RecentCallers recent_;
  Workers idle_;             // The one that was used last is the last.
  std::size_t working_ = 0;  // Workers that are not idle.
  BusyStreams busy_;
  // When somebody wanted what idle workers keep warm: those that are older go.
  WarmSize::Clock::time_point memory_was_short_{};
  WarmSize::Clock::time_point gave_back_ = WarmSize::Clock::now();
  bool stopping_ = false;

  std::vector<std::thread> runners_;
};

}  // namespace partiemc::server
