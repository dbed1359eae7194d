// Parts of a stage in parallel, in the oneTBB arena of the caller: the only place where the core
// uses tasks. All return when everything is done; an exception of a body comes out of the call.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

#include "fork_join.h"

namespace partiemc {

struct WorldPosition;

// What oneTBB runs, without types: parallel.cc alone is compiled against oneTBB's templates, and
// without ThreadSanitizer, which would take their hand-overs for races. What tasks do themselves is
// in the templates below and instrumented like everything else.
namespace erased {

struct Action {
  void (*run)(const void* body);
  const void* body;
};
struct RangeAction {
  void (*run)(const void* body, std::size_t first, std::size_t last);
  const void* body;
};
void Invoke(Action a, Action b);
void ForRanges(std::size_t count, std::size_t grain, RangeAction action);

}  // namespace erased

/// Calls body(first, last) for ranges that together are [0, count), each of at least half of
/// `grain` where there are so many.
template <std::invocable<std::size_t, std::size_t> Body>
void ParallelForRanges(std::size_t count, std::size_t grain, const Body& body) {
  ForkJoin fork_join;
  const auto task = [&](std::size_t first, std::size_t last) {
    const ForkJoin::Task scope(fork_join);
    body(first, last);
  };
  const auto run = [](const void* erased, std::size_t first, std::size_t last) {
    (*static_cast<const decltype(task)*>(erased))(first, last);
  };
  erased::ForRanges(count, grain, {run, &task});
}

/// Calls body(k) for each k of [0, count).
template <std::integral Index, std::invocable<Index> Body>
void ParallelFor(Index count, const Body& body) {
  ParallelForRanges(static_cast<std::size_t>(count), 1, [&](std::size_t first, std::size_t last) {
    for (auto k = static_cast<Index>(first); k < static_cast<Index>(last); ++k) body(k);
  });
}

/// Calls a() and b().
template <std::invocable A, std::invocable B>
void ParallelInvoke(const A& a, const B& b) {
  ForkJoin fork_join;
  const auto task = [&fork_join](const auto& body) {
    return [&] {
      const ForkJoin::Task scope(fork_join);
      body();
    };
  };
  const auto action = []<typename Task>(const Task& of) {
    return erased::Action{[](const void* erased) { (*static_cast<const Task*>(erased))(); }, &of};
  };
  const auto task_a = task(a);
  const auto task_b = task(b);
  erased::Invoke(action(task_a), action(task_b));
}

/// Sorts by x, then by y.
void ParallelSort(std::span<WorldPosition> positions);

}  // namespace partiemc
