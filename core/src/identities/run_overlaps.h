// The lattice nodes that rings of two frames share, where they are or after having been moved.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/state.h"

namespace partiemc {

/// How far something moves, in whole cells.
struct CellShift {
  std::int64_t columns = 0, rows = 0;
  friend bool operator==(const CellShift&, const CellShift&) = default;
};

/// Nodes that ring `a` of one set of runs and ring `b` of another share.
struct SharedNodes {
  std::uint32_t a = 0, b = 0;
  std::uint64_t nodes = 0;
};

/// `runs` moved by the shifts of their rings, by row, then column; they may come to overlap. What
/// would leave the range of rows and columns is left out.
void MoveRuns(std::span<const NodeRun> runs, std::span<const CellShift> shift_of_ring,
              std::vector<NodeRun>& moved);

/// Writes to `shared` the pairs of rings that share nodes, by a, then b, each once. `a_runs` are
/// sorted by row, then column; `b_runs` are disjoint too. `newest` is scratch, by ring of `a_runs`.
/// Moved rings that pile up on each other could meet any number of times: beyond 16 encounters a
/// run, `shared` is left empty. Runs that are where they were, or moved without collisions, meet
/// at most once each. Cost: linear in runs and their rings, n log n in pairs of rings, at worst in
/// encounters.
void FindSharedNodes(std::span<const NodeRun> a_runs, std::span<const NodeRun> b_runs,
                     std::vector<std::uint32_t>& newest, std::vector<SharedNodes>& shared);

/// Nodes of a run.
inline std::uint64_t NodeCount(std::int32_t first, std::int32_t last) {
  return static_cast<std::uint64_t>(std::int64_t{last} - first + 1);
}

}  // namespace partiemc
