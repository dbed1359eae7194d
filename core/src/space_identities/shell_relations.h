// Finds the pairs of related shells of two successive frames, and the number of nodes they share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/relations.h"
#include "identities/shared_nodes.h"
#include "partiemc/surface_state.h"
#include "periodic/frame_box.h"
#include "periodic/run_periods.h"
#include "space_identities/shell_tracks.h"

namespace partiemc::space {

/// The shells of this frame, by number.
struct ShellsNow {
  std::span<const ShellRun> runs;           ///< `shell` is a number.
  std::span<const KnownShell> shells;       ///< `outer` is a number.
  std::span<const FoundShellSample> found;  ///< By `before`, then `now`.
  bool has_ids = false;
  double time = 0;
  double cell_size = 1;  ///< World units.
  LatticePeriods periods = {};
};

/// Warm buffers of RelateShells.
struct ShellRelationScratch {
  std::vector<NodeShift> shift_before, shift_now;
  std::vector<std::int64_t> displacements;
  std::vector<ShellRun> moved, wrapped;
  std::vector<ShellRun> wrapped_before, wrapped_now;  // Unused without a periodic box.
  std::vector<SharedNodes> shared;
  std::vector<std::uint32_t> newest;  // For SweepSharedNodes.
  Evidence evidence;
};

/// Sets `moved` to `history` after the motion of its box, as MoveWithBox for rings.
void MoveWithBox(const BoxMotion& motion, const ShellHistory& history, ShellHistory& moved);

/// Finds the related shells by the rules for rings (core/IDENTITIES.md). First moves the shells of
/// the last frame by the median displacement of their samples; by their velocities if no shell has
/// samples. Also moves the shells of this frame backward by their velocities. Then counts the nodes
/// that shells share. If samples contradict the nodes, the samples decide. `relations` gets each
/// pair once, in no particular order. Cost: n log n in runs, shells and samples.
void RelateShells(const ShellHistory& previous, const ShellsNow& now, ShellRelationScratch& scratch,
                  std::vector<Relation>& relations);

}  // namespace partiemc::space
