// The threads that compute, shared by all streams.
#pragma once

#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "partiemc/arena.h"
#include "server/busy_streams.h"
#include "server/worker.h"

namespace partiemc::server {

/// For how long a worker keeps buffers that it has no use for.
inline constexpr std::chrono::seconds kWarmTime(10);

/// Runs jobs in the order in which they were submitted, several at once, all parallel parts of all
/// of them in one arena. A stream submits its next frame only when the one before is done,
/// so that this order is a round robin over the streams that have work: a stream of large frames
/// delays every other by one of its frames at most, never by its backlog.
///
/// Memory: a job gets the worker that was used last, so that one stream keeps one of them warm,
/// however many threads there are. A worker that for `warm_time` has had no frame of at least a
/// quarter of its largest is dropped with all of its buffers: after a large frame an idle server,
/// or one with small frames, soon holds no more than it needs. It stays where as many streams as
/// there are workers send such frames: how often these meet is luck, and may change by the minute,
/// but they can at any time. What is free of the process's memory goes back to the system whenever
/// a worker is dropped, and every `warm_time` while there is work: what requests and answers needed
/// at some moment, and the gaps that they left, do not add up.
class ComputePool {
 public:
  using Job = std::function<void(Worker&)>;
  using Afterwards = std::function<void()>;

  /// `threads` is what all jobs together may use, at least 1. While it lives, the whole process
  /// gives oneTBB no more than that.
  /// `observer` outlives the pool.
  explicit ComputePool(unsigned threads, WarmSize::Clock::duration warm_time = kWarmTime,
                       FrameObserver* observer = nullptr);
  /// Runs what was submitted, then joins.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Runs `job`, then `afterwards`, which has no worker any more: what it submits gets the same
  /// one. `stream` is of the stream whose frame it is, if any, and lives as long as `job`. Never
  /// blocks on computing. Neither may throw. Safe from any thread, jobs included.
  void Submit(
      Job job, Afterwards afterwards = [] {}, BusyStreams::Mark* stream = nullptr);

  /// Jobs that have been submitted and not begun.
  std::size_t QueueLength() const;

  unsigned threads() const { return static_cast<unsigned>(runners_.size()); }

 private:
  struct Task {
    Job job;
    Afterwards afterwards;
    BusyStreams::Mark* stream;
  };
  using Workers = std::vector<std::unique_ptr<Worker>>;

  void Run();
  // With the lock held; those that get it let it go for a while:
  void WaitForTask(std::unique_lock<std::mutex>& lock);
  std::unique_ptr<Worker> TakeWorker();
  void PutBack(std::unique_ptr<Worker> worker, BusyStreams::Mark* stream);
  Workers TakeOutlived();
  void GiveBack(Workers workers, bool due, std::unique_lock<std::mutex>& lock);

  const WarmSize::Clock::duration warm_time_;
  FrameObserver* const observer_;
  oneapi::tbb::global_control parallelism_;
  Arena arena_;
  mutable std::mutex mutex_;
  std::condition_variable task_came_;
  std::deque<Task> tasks_;   // Guarded by mutex_.
  Workers idle_;             // Guarded by mutex_. The one that was used last is the last.
  std::size_t working_ = 0;  // Guarded by mutex_. Workers that are not idle.
  BusyStreams busy_;         // Guarded by mutex_.
  WarmSize::Clock::time_point gave_back_ = WarmSize::Clock::now();  // Guarded by mutex_.
  bool stopping_ = false;                                           // Guarded by mutex_.
  std::vector<std::thread> runners_;
};

}  // namespace partiemc::server
