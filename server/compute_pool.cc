#include "server/compute_pool.h"

#include <pthread.h>

#include <algorithm>
#include <utility>

#include "server/heap.h"

namespace partiemc::server {

// Runners are plain threads and not tasks of the arena, so that a thread that waits for the pieces
// of one frame can pick up pieces of another, but never another frame as a whole. There are as many
// runners as the arena has places: small frames then run side by side, and a large one that is
// alone gets every place for its pieces.
ComputePool::ComputePool(unsigned threads, WarmSize::Clock::duration warm_time,
                         FrameObserver* observer)
    : warm_time_(warm_time),
      observer_(observer),
      parallelism_(oneapi::tbb::global_control::max_allowed_parallelism, std::max(threads, 1u)),
      arena_(std::max(threads, 1u)),
      busy_(warm_time) {
  runners_.reserve(std::max(threads, 1u));
  for (unsigned i = 0; i < std::max(threads, 1u); ++i) {
    runners_.emplace_back([this] { Run(); });
  }
}

ComputePool::~ComputePool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  task_came_.notify_all();
  for (std::thread& runner : runners_) runner.join();
}

void ComputePool::Submit(Job job, Afterwards afterwards, BusyStreams::Mark* stream) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back({std::move(job), std::move(afterwards), stream});
  }
  task_came_.notify_one();
}

std::size_t ComputePool::QueueLength() const {
  const std::lock_guard lock(mutex_);
  return tasks_.size();
}

void ComputePool::Run() {
  // Threads that oneTBB starts for the pieces of a frame have it from this one.
  pthread_setname_np(pthread_self(), "compute");
  std::unique_lock lock(mutex_);
  for (;;) {
    WaitForTask(lock);
    if (tasks_.empty()) return;
    {
      const Task task = std::move(tasks_.front());
      tasks_.pop_front();
      std::unique_ptr<Worker> worker = TakeWorker();
      lock.unlock();
      arena_.Execute([&] { task.job(*worker); });
      lock.lock();
      PutBack(std::move(worker), task.stream);
      lock.unlock();
      task.afterwards();
    }
    lock.lock();
    GiveBack(TakeOutlived(), WarmSize::Clock::now() - gave_back_ >= warm_time_, lock);
  }
}

// Returns when there is a task, or never will be.
void ComputePool::WaitForTask(std::unique_lock<std::mutex>& lock) {
  const auto over = [this] { return stopping_ || !tasks_.empty(); };
  while (!over()) {
    const bool warm = std::ranges::any_of(idle_, [](auto& w) { return w->particles.used(); });
    if (warm) {
      task_came_.wait_for(lock, warm_time_, over);
    } else {
      task_came_.wait(lock);
    }
    GiveBack(TakeOutlived(), false, lock);
  }
}

std::unique_ptr<Worker> ComputePool::TakeWorker() {
  ++working_;
  if (idle_.empty()) {
    auto worker = std::make_unique<Worker>();
    worker->observer = observer_;
    return worker;
  }
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

ComputePool::Workers ComputePool::TakeOutlived() {
  Workers outlived;
  const auto now = WarmSize::Clock::now();
  std::size_t workers = working_ + idle_.size();
  std::erase_if(idle_, [&](std::unique_ptr<Worker>& worker) {
    const WarmSize& particles = worker->particles;
    if (!particles.Outlived(now, warm_time_)) return false;
    if (busy_.Count(WarmSize::LeastFor(particles.largest()), now) >= workers) return false;
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
