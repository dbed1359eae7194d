// Counts the lattice nodes that rings of two frames share, with or without moving the rings first.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/shared_nodes.h"
#include "partiemc/state.h"
#include "periodic/frame_box.h"
#include "periodic/run_periods.h"

namespace partiemc {

/// A displacement in whole cells.
struct CellShift {
  std::int64_t columns = 0, rows = 0;
  friend bool operator==(const CellShift&, const CellShift&) = default;
};

inline std::int32_t RowOf(const NodeRun& run) { return run.row; }
inline std::uint32_t PieceOf(const NodeRun& run) { return run.ring; }

/// Writes `runs`, moved by the shifts of their rings, to `moved`, sorted by row, then column. Moved
/// runs may overlap. Drops runs whose coordinates exceed 32 bits.
void MoveRuns(std::span<const NodeRun> runs, std::span<const CellShift> shift_of_ring,
              std::vector<NodeRun>& moved);

/// Writes `runs`, wrapped into the periodic box, to `wrapped`, sorted by row, then column. Runs are
/// split at faces. Runs of holes may then overlap other runs.
void WrapRuns(std::span<const NodeRun> runs, const LatticePeriods& periods,
              std::vector<NodeRun>& wrapped);

/// Sets `moved` to `history` after the motion of its box: each run moves with its middle node, each
/// sample to the nearest node. Moved runs may overlap.
void MoveWithBox(const BoxMotion& motion, const RingHistory& history, RingHistory& moved);

/// Writes to `shared` the pairs of rings that share nodes: each pair once, sorted by `a`, the ring
/// in `a_runs`, then `b`. `newest` is scratch. Requires: both sets of runs are sorted by row, then
/// column.
///
/// Runs of `b_runs` should not overlap each other: each such overlap costs a comparison. Moved
/// rings may overlap without limit. If there are more than kMaxOverlapsPerRun overlaps per run of
/// both sets, `shared` is therefore left empty.
/// Cost: linear in runs, rings and overlaps, n log n in pairs of rings.
void FindSharedNodes(std::span<const NodeRun> a_runs, std::span<const NodeRun> b_runs,
                     std::vector<std::uint32_t>& newest, std::vector<SharedNodes>& shared);

}  // namespace partiemc
