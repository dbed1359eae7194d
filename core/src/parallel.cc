#include "parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>

#include "frame_view.h"

namespace partiemc {
namespace erased {

void Invoke(Action a, Action b) {
  tbb::parallel_invoke([&] { a.run(a.body); }, [&] { b.run(b.body); });
}

void ForRanges(std::size_t count, std::size_t grain, RangeAction action) {
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, count, grain), [&](const Range& range) {
    action.run(action.body, range.begin(), range.end());
  });
}

}  // namespace erased

void ParallelSort(std::span<WorldPosition> positions) {
  tbb::parallel_sort(positions.begin(), positions.end(), [](const auto& a, const auto& b) {
    return a.x != b.x ? a.x < b.x : a.y < b.y;
  });
}

}  // namespace partiemc
