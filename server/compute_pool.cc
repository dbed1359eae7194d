#include "server/compute_pool.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {

// Runners are plain threads and not tasks of the arena, so that a thread that waits for the pieces
// of one frame can pick up pieces of another, but never another frame as a whole. There are as many
// runners as the arena has places: small frames then run side by side, and a large one that is
// alone gets every place for its pieces.
ComputePool::ComputePool(unsigned threads) : arena_(static_cast<int>(std::max(threads, 1u))) {
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
  job_came_.notify_all();
  for (std::thread& runner : runners_) runner.join();
}

void ComputePool::Submit(Job job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  job_came_.notify_one();
}

void ComputePool::Run() {
  Worker worker;
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      job_came_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    arena_.execute([&] { job(worker); });
  }
}

}  // namespace partiemc::server
