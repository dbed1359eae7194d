#include "server/compute/compute_pool.h"

#include <pthread.h>

#include <algorithm>
#include <utility>

#include "server/compute/heap.h"

namespace partiemc::server {

// Runners are plain threads and not tasks of the arena, so that a thread that waits for the pieces
// of one frame can pick up pieces of another, but never another frame as a whole. There are as many
// runners as the arena has places: small frames then run side by side, and a large one that is
// alone gets every place for its pieces.
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
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  task_came_.notify_all();
  for (std::thread& runner : runners_) runner.join();
}

void ComputePool::Submit(Job job, Afterwards afterwards, BusyStreams::Mark* stream,
                         const CallerAccount* caller, std::uint64_t frame_bytes) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.Push(caller, stream,
                Task{std::move(job), std::move(afterwards), stream, caller, frame_bytes});
    ++waiting_;
    recent_.Came(caller, WarmSize::Clock::now());
  }
  task_came_.notify_one();
}

std::size_t ComputePool::QueueLength() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

void ComputePool::Run() {
  // Threads that oneTBB starts for the pieces of a frame have it from this one.
  pthread_setname_np(pthread_self(), "compute");
  std::optional<Arena> narrow;  // For jobs of callers who share.
  std::unique_lock lock(mutex_);
  while (std::optional<Task> task = WaitForTask(lock)) {
    Begin(*task);
    const bool shares = Shares(task->caller);
    std::unique_ptr<Worker> worker = TakeWorker();
    lock.unlock();
    if (shares && !narrow) narrow.emplace(threads_ - 1);
    // Outside of the arena, whose threads must not wait for each other's frames.
    worker->memory.BeginFrame(task->frame_bytes);
    (shares ? *narrow : arena_).Execute([&] { task->job(*worker); });
    if (worker->memory.is_beyond()) worker->Empty();  // Another worker may wait for it.
    worker->memory.EndFrame();
    lock.lock();
    PutBack(std::move(worker), task->stream);
    End(*task);
    lock.unlock();
    task->afterwards();
    task.reset();  // With all that it holds, without the lock.
    lock.lock();
    GiveBack(TakeOutlived(), WarmSize::Clock::now() - gave_back_ >= warm_time_, lock);
  }
}

// Returns when there is a task that may run, or with none when there never will be.
std::optional<ComputePool::Task> ComputePool::WaitForTask(std::unique_lock<std::mutex>& lock) {
  for (;;) {
    if (auto task = NextTask()) return task;
    if (stopping_) return std::nullopt;
    const bool warm = std::ranges::any_of(idle_, [](auto& w) { return w->particles.used(); });
    if (waiting_ > 0) {  // For a thread that may be kept free of nobody by then.
      task_came_.wait_for(lock, kSharingTime);
    } else if (warm) {
      task_came_.wait_for(lock, warm_time_);
    } else {
      task_came_.wait(lock);
    }
    GiveBack(TakeOutlived(), false, lock);
  }
}

// The first whose caller may have one more, if any.
std::optional<ComputePool::Task> ComputePool::NextTask() {
  auto task = tasks_.PopOf([this](const CallerAccount* caller) {
    const auto running = std::ranges::count(running_, caller);
    return stopping_ || running < std::ptrdiff_t{threads_} - (Shares(caller) ? 1 : 0);
  });
  if (task) --waiting_;
  return task;
}

// Whether a thread is to stay free of this caller.
bool ComputePool::Shares(const CallerAccount* caller) const {
  return threads_ > 1 && recent_.AnybodyBut(caller, WarmSize::Clock::now() - kSharingTime);
}

void ComputePool::Begin(const Task& task) { running_.push_back(task.caller); }

void ComputePool::End(const Task& task) {
  running_.erase(std::ranges::find(running_, task.caller));
  recent_.Came(task.caller, WarmSize::Clock::now());
  // Its caller may have one more, and, once alone, all threads.
  if (waiting_ > 0) task_came_.notify_one();
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
  const std::lock_guard lock(mutex_);
  if (now - memory_was_short_ < kBetweenShortages) return;
  memory_was_short_ = now;
  task_came_.notify_one();
}

ComputePool::Workers ComputePool::TakeOutlived() {
  Workers outlived;
  const auto now = WarmSize::Clock::now();
  std::size_t workers = working_ + idle_.size();
  std::erase_if(idle_, [&](std::unique_ptr<Worker>& worker) {
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

// Where `due`, or where there are `workers` to drop. Lets `lock` go meanwhile.
void ComputePool::GiveBack(Workers workers, bool due, std::unique_lock<std::mutex>& lock) {
  if (workers.empty() && !due) return;
  gave_back_ = WarmSize::Clock::now();
  lock.unlock();
  workers.clear();
  GiveBackFreedMemory();
  lock.lock();
}

}  // namespace partiemc::server
