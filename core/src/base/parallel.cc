#include "base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace partiemc {

class TaskArena : public tbb::task_arena {
 public:
  using tbb::task_arena::task_arena;
};

namespace erased {
namespace {

void ThrowIfGivenUp() {
  if (tbb::is_current_task_group_canceling()) throw Cancelled();
}

}  // namespace

void Invoke(const Action& a, const Action& b) {
  tbb::parallel_invoke([&] { a.run(a.fork_join, a.body); }, [&] { b.run(b.fork_join, b.body); });
  ThrowIfGivenUp();
}

void ForRanges(std::size_t count, std::size_t grain, const RangeAction& action) {
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, count, grain), [&](const Range& range) {
    action.run(action.fork_join, action.body, range.begin(), range.end());
  });
  ThrowIfGivenUp();
}

std::size_t ThreadCount() {
  return static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

TaskArena* MakeArena(unsigned threads) {
  return new TaskArena(threads > 0 ? static_cast<int>(threads) : tbb::info::default_concurrency());
}

void DeleteArena(TaskArena* arena) { delete arena; }

void Execute(TaskArena& arena, const Action& action) {
  arena.execute([&] { action.run(action.fork_join, action.body); });
}

}  // namespace erased

}  // namespace partiemc
