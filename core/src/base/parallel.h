// Runs the parts of a stage in parallel, in the caller's arena (partiemc/arena.h). Only this file
// and parallel.cc create tasks. Each function returns when all work is done, and rethrows an
// exception of a body. If the frame is cancelled (cancellation.h), the functions throw Cancelled
// before the next index or range.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>

#include "base/cancellation.h"
#include "base/fork_join.h"

namespace partiemc {

class TaskArena;

// Type-erased tasks. Only parallel.cc includes oneTBB's templates, and it is compiled without
// ThreadSanitizer, which would report their hand-overs of work as races. The bodies of the tasks
// are called from the templates below, so they are instrumented.
namespace erased {

// Requires: `body` and `fork_join` outlive the action.
struct Action {
  void (*run)(ForkJoin& fork_join, const void* body);
  ForkJoin& fork_join;
  const void* body;
};
struct RangeAction {
  void (*run)(ForkJoin& fork_join, const void* body, std::size_t first, std::size_t last);
  ForkJoin& fork_join;
  const void* body;
};

template <std::invocable Body>
Action ActionOf(ForkJoin& fork_join, const Body& body) {
  const auto run = [](ForkJoin& forked, const void* erased) {
    const ForkJoin::Task scope(forked);
    (*static_cast<const Body*>(erased))();
  };
  return {run, fork_join, &body};
}

template <std::invocable<std::size_t, std::size_t> Body>
RangeAction RangeActionOf(ForkJoin& fork_join, const Body& body) {
  const auto run = [](ForkJoin& forked, const void* erased, std::size_t first, std::size_t last) {
    const ForkJoin::Task scope(forked);
    (*static_cast<const Body*>(erased))(first, last);
  };
  return {run, fork_join, &body};
}

// Both functions throw Cancelled if the calling task was cancelled because another task of its
// group threw. In that case oneTBB skips work without reporting it.
void Invoke(const Action& a, const Action& b);
void ForRanges(std::size_t count, std::size_t grain, const RangeAction& action);

std::size_t ThreadCount();

TaskArena* MakeArena(unsigned threads);  // 0: one for each processor.
void DeleteArena(TaskArena* arena);
void Execute(TaskArena& arena, const Action& action);

}  // namespace erased

/// Number of threads of the caller's arena.
inline std::size_t ThreadCount() { return erased::ThreadCount(); }

/// Calls body(first, last) for ranges that partition [0, count). Ranges have at least grain / 2
/// elements, if `count` allows.
template <std::invocable<std::size_t, std::size_t> Body>
void ParallelForRanges(std::size_t count, std::size_t grain, const Body& body) {
  const std::atomic<bool>* const flag = CancellationScope::Current();
  const auto range = [flag, &body](std::size_t first, std::size_t last) {
    const CancellationScope scope(flag);
    ThrowIfCancelled(flag);
    body(first, last);
  };
  ForkJoin fork_join;
  erased::ForRanges(count, grain, erased::RangeActionOf(fork_join, range));
}

/// Calls body(k) for each k of [0, count).
template <std::integral Index, std::invocable<Index> Body>
void ParallelFor(Index count, const Body& body) {
  const std::atomic<bool>* const flag = CancellationScope::Current();
  ParallelForRanges(static_cast<std::size_t>(count), 1, [&](std::size_t first, std::size_t last) {
    for (auto k = static_cast<Index>(first); k < static_cast<Index>(last); ++k) {
      ThrowIfCancelled(flag);
      body(k);
    }
  });
}

/// Calls a() and b() in parallel.
template <std::invocable A, std::invocable B>
void ParallelInvoke(const A& a, const B& b) {
  const std::atomic<bool>* const flag = CancellationScope::Current();
  const auto with_flag = [flag](const auto& body) {
    return [flag, &body] {
      const CancellationScope scope(flag);
      ThrowIfCancelled(flag);
      body();
    };
  };
  const auto first = with_flag(a);
  const auto second = with_flag(b);
  ForkJoin fork_join;
  erased::Invoke(erased::ActionOf(fork_join, first), erased::ActionOf(fork_join, second));
}

/// Sorts by `less`; not stable. Quicksort partitions at most `splits` levels deep, then std::sort
/// sorts the parts, so no order of the input makes the sort slow.
template <typename T, typename Less>
void ParallelSort(std::span<T> values, const Less& less, int splits = 6) {
  constexpr std::size_t kSortedAtOnce = 1 << 11;
  if (splits == 0 || values.size() <= kSortedAtOnce) {
    std::sort(values.begin(), values.end(), less);
    return;
  }
  std::array<T, 9> sample;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    sample[k] = values[k * (values.size() - 1) / (sample.size() - 1)];
  }
  const auto median = sample.begin() + sample.size() / 2;
  std::nth_element(sample.begin(), median, sample.end(), less);
  const auto equal = std::partition(values.begin(), values.end(),
                                    [&](const T& value) { return less(value, *median); });
  const auto greater =
      std::partition(equal, values.end(), [&](const T& value) { return !less(*median, value); });
  ParallelInvoke([&] { ParallelSort(std::span(values.begin(), equal), less, splits - 1); },
                 [&] { ParallelSort(std::span(greater, values.end()), less, splits - 1); });
}

}  // namespace partiemc
