#include "server/compute/compute_pool.h"

#include <pthread.h>

#include <algorithm>
#include <utility>

namespace partiemc::server {

// The pool's threads ("runners") are plain threads, not tasks of the oneTBB arena. If frames were
// tasks, a thread that waits for the parallel parts of one frame could begin a whole other frame.
// The number of runners equals the number of slots of the arena. So small frames run concurrently,
// and a single large frame uses all slots.
ComputePool::ComputePool(unsigned threads, WarmSize::Clock::duration warm_time,
                         FrameObserver* observer, MemoryBudget* budget)
    : threads_(std::max(threads, 1u)),
      warm_time_(warm_time),
      observer_(observer),
      budget_(budget),
      parallelism_(oneapi::tbb::global_control::max_allowed_parallelism, threads_),
      arena_(threads_),
      busy_(warm_time) {
  if (budget_ != nullptr) budget_->OnShortage([this] { MemoryIsShort(); });
  running_.reserve(threads_);
  runners_.reserve(threads_);
  for (unsigned i = 0; i < threads_; ++i) runners_.emplace_back([this] { Run(); });
}

ComputePool::~ComputePool() {
  if (budget_ != nullptr) budget_->OnShortage({});
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  task_came_.NotifyAll();
  for (std::thread& runner : runners_) runner.join();
}

void ComputePool::Submit(Job job, Afterwards afterwards, BusyStreams::Mark* stream,
                         const CallerAccount* caller, std::uint64_t frame_bytes) {
  {
    const MutexLock lock(mutex_);
    tasks_.Push(caller, stream,
                Task{std::move(job), std::move(afterwards), stream, caller, frame_bytes});
    ++waiting_;
    recent_.Came(caller, WarmSize::Clock::now());
  }
  task_came_.NotifyOne();
}

std::size_t ComputePool::QueueLength() const {
  const MutexLock lock(mutex_);
  return waiting_;
}

void ComputePool::Run() {
  // Threads that oneTBB starts inherit the name.
  pthread_setname_np(pthread_self(), "compute");
  std::optional<Arena> narrow;  // For jobs of competing callers.
  const MutexLock lock(mutex_);
  while (std::optional<Task> task = WaitForTask()) {
    running_.push_back(task->caller);
    const bool shares = Shares(task->caller);
    std::unique_ptr<Worker> worker = TakeWorker();
    {
      const MutexUnlock unlock(mutex_);
      if (shares && !narrow) narrow.emplace(threads_ - 1);
      // Outside the arena, because BeginFrame may block, and other frames use the arena's slots.
      worker->memory.BeginFrame(task->frame_bytes);
      (shares ? *narrow : arena_).Execute([&] { task->job(*worker); });
      if (worker->memory.is_beyond()) worker->Empty();  // Another worker may wait for this memory.
      worker->memory.EndFrame();
    }
    PutBack(std::move(worker), task->stream);
    End(*task);
    {
      const MutexUnlock unlock(mutex_);
      task->afterwards();
      task.reset();  // Destructors of captured objects run without the lock.
    }
    Destroy(TakeOutlived());
  }
}

// Waits for a task that may run. Returns nothing if the pool stops and no task is left.
std::optional<ComputePool::Task> ComputePool::WaitForTask() {
  for (;;) {
    if (auto task = NextTask()) return task;
    if (stopping_) return std::nullopt;
    const bool warm = std::ranges::any_of(idle_, [](auto& w) { return w->particles.used(); });
    if (waiting_ > 0) {  // After kSharingTime the callers may no longer compete, so a task may run.
      task_came_.WaitUntil(mutex_, WarmSize::Clock::now() + kSharingTime);
    } else if (warm) {
      task_came_.WaitUntil(mutex_, WarmSize::Clock::now() + warm_time_);
    } else {
      task_came_.Wait(mutex_);
    }
    Destroy(TakeOutlived());
  }
}

// Returns the first task whose caller may run another job now.
std::optional<ComputePool::Task> ComputePool::NextTask() {
  auto task = tasks_.PopOf([this](const CallerAccount* caller) {
    mutex_.AssertHeld();
    const auto running = std::ranges::count(running_, caller);
    return stopping_ || running < std::ptrdiff_t{threads_} - (Shares(caller) ? 1 : 0);
  });
  if (task) --waiting_;
  return task;
}

// Whether `caller` must leave one thread free, because another caller was active recently.
bool ComputePool::Shares(const CallerAccount* caller) const {
  return threads_ > 1 && recent_.AnybodyBut(caller, WarmSize::Clock::now() - kSharingTime);
}

void ComputePool::End(const Task& task) {
  running_.erase(std::ranges::find(running_, task.caller));
  recent_.Came(task.caller, WarmSize::Clock::now());
  // The caller of the finished task may now run another job, so a thread checks the queue.
  if (waiting_ > 0) task_came_.NotifyOne();
}

std::unique_ptr<Worker> ComputePool::TakeWorker() {
  ++working_;
  if (idle_.empty()) return std::make_unique<Worker>(observer_, budget_);
  std::unique_ptr<Worker> worker = std::move(idle_.back());
  idle_.pop_back();
  return worker;
}

void ComputePool::PutBack(std::unique_ptr<Worker> worker, BusyStreams::Mark* stream) {
  const std::size_t particles = worker->particles.TakeLast();
  if (stream != nullptr && particles > 0) {
    busy_.Worked(*stream, particles, WarmSize::Clock::now());
  }
  idle_.push_back(std::move(worker));
  --working_;
}

void ComputePool::MemoryIsShort() {
  const auto now = WarmSize::Clock::now();
  const MutexLock lock(mutex_);
  if (now - memory_was_short_ < kBetweenShortages) return;
  memory_was_short_ = now;
  task_came_.NotifyOne();
}

ComputePool::Workers ComputePool::TakeOutlived() {
  Workers outlived;
  const auto now = WarmSize::Clock::now();
  std::size_t workers = working_ + idle_.size();
  std::erase_if(idle_, [&](std::unique_ptr<Worker>& worker) {
    mutex_.AssertHeld();
    const WarmSize& particles = worker->particles;
    const bool is_wanted = worker->memory.counts() && worker->made < memory_was_short_;
    if (!is_wanted) {
      if (!particles.Outlived(now, warm_time_)) return false;
      if (busy_.Count(WarmSize::LeastFor(particles.largest()), now) >= workers) return false;
    }
    --workers;
    outlived.push_back(std::move(worker));
    return true;
  });
  return outlived;
}

// Destroys `workers` without the mutex.
void ComputePool::Destroy(Workers workers) {
  if (workers.empty()) return;
  const MutexUnlock unlock(mutex_);
  workers.clear();
}

}  // namespace partiemc::server
