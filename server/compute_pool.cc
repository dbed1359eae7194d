#include "server/compute_pool.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {
namespace {

// ThreadSanitizer cannot see how oneTBB hands work from thread to thread, because the library as
// distributed is not instrumented: it takes every hand-over for a race. Under it each runner
// computes alone, so that all that it sees, and all that it reports, is ours.
#ifdef __SANITIZE_THREAD__
constexpr bool kShareArena = false;
#else
constexpr bool kShareArena = true;
#endif

}  // namespace

// Runners are plain threads and not tasks of the arena, so that a thread that waits for the pieces
// of one frame can pick up pieces of another, but never another frame as a whole. There are as many
// runners as the arena has places: small frames then run side by side, and a large one that is
// alone gets every place for its pieces.
ComputePool::ComputePool(unsigned threads)
    : parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                   kShareArena ? std::max(threads, 1u) : 1u),
      arena_(static_cast<int>(std::max(threads, 1u))) {
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
  oneapi::tbb::task_arena own_arena(1);
  oneapi::tbb::task_arena& arena = kShareArena ? arena_ : own_arena;
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      job_came_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    arena.execute([&] { job(worker); });
  }
}

}  // namespace partiemc::server
