#include "identities/run_overlaps.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace partiemc {
namespace {

bool Fits(std::int64_t value) {
  return value >= std::numeric_limits<std::int32_t>::min() &&
         value <= std::numeric_limits<std::int32_t>::max();
}

bool ComesBefore(const NodeRun& a, const NodeRun& b) {
  return std::tie(a.row, a.first, a.ring) < std::tie(b.row, b.first, b.ring);
}

}  // namespace

void MoveRuns(std::span<const NodeRun> runs, std::span<const CellShift> shift_of_ring,
              std::vector<NodeRun>& moved) {
  moved.clear();
  for (const NodeRun& run : runs) {
    const CellShift& shift = shift_of_ring[run.ring];
    const std::int64_t row = run.row + shift.rows;
    const std::int64_t first = run.first + shift.columns;
    const std::int64_t last = run.last + shift.columns;
    if (!Fits(row) || !Fits(first) || !Fits(last)) continue;
    moved.push_back({static_cast<std::int32_t>(row), static_cast<std::int32_t>(first),
                     static_cast<std::int32_t>(last), run.ring});
  }
  // Usually the runs are still sorted, because all of them move alike or not at all.
  if (std::is_sorted(moved.begin(), moved.end(), ComesBefore)) return;
  std::sort(moved.begin(), moved.end(), ComesBefore);
}

void WrapRuns(std::span<const NodeRun> runs, const LatticePeriods& periods,
              std::vector<NodeRun>& wrapped) {
  wrapped.clear();
  for (const NodeRun& run : runs) {
    const auto row = static_cast<std::int32_t>(run.row - WrapOf(periods.cells[1], run.row));
    ForEachWrapped(periods.cells[0], run.first, run.last,
                   [&](std::int32_t first, std::int32_t last) {
                     wrapped.push_back({row, first, last, run.ring});
                   });
  }
  std::sort(wrapped.begin(), wrapped.end(), ComesBefore);
}

void MoveWithBox(const BoxMotion& motion, const RingHistory& history, RingHistory& moved) {
  moved = history;
  for (NodeRun& run : moved.runs) {
    run.row = motion.NodeAt(1, run.row);
    motion.MoveRun(0, run.first, run.last);
  }
  std::sort(moved.runs.begin(), moved.runs.end(), ComesBefore);
  for (ParticleSample& sample : moved.samples) {
    sample.column = motion.NodeAt(0, sample.column);
    sample.row = motion.NodeAt(1, sample.row);
  }
}

void FindSharedNodes(std::span<const NodeRun> a_runs, std::span<const NodeRun> b_runs,
                     std::vector<std::uint32_t>& newest, std::vector<SharedNodes>& shared) {
  SweepSharedNodes<NodeRun>(a_runs, b_runs, newest, shared);
}

}  // namespace partiemc
