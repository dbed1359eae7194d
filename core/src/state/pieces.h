// Common names for the members of histories of rings and of shells, for the code that serves both.
//
// A piece is a ring of an outline or a shell of a surface. An inner piece is a hole or a cavity.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/bits.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "partiemc/surface_state.h"

namespace partiemc {

// KnownRing::outer and KnownShell::outer are kNoIndex if they name no piece.
static_assert(kNoRing == kNoIndex && kNoShell == kNoIndex);

struct RingPieces {
  static constexpr char kName[] = "ring", kInnerName[] = "hole";  // In messages.
  static constexpr std::size_t kDimensions = 2;
  using History = RingHistory;
  using Known = KnownRing;
  using Run = NodeRun;
};

struct ShellPieces {
  static constexpr char kName[] = "shell", kInnerName[] = "cavity";
  static constexpr std::size_t kDimensions = 3;
  using History = ShellHistory;
  using Known = KnownShell;
  using Run = ShellRun;
};

inline const std::vector<KnownRing>& PiecesOf(const RingHistory& history) { return history.rings; }
inline const std::vector<KnownShell>& PiecesOf(const ShellHistory& history) {
  return history.shells;
}

inline bool IsInner(const KnownRing& ring) { return ring.is_hole; }
inline bool IsInner(const KnownShell& shell) { return shell.is_cavity; }

inline std::array<double, 2> VelocityOf(const KnownRing& ring) {
  return {ring.velocity_x, ring.velocity_y};
}
inline std::array<double, 3> VelocityOf(const KnownShell& shell) {
  return {shell.velocity_x, shell.velocity_y, shell.velocity_z};
}

inline std::uint32_t PieceOf(const NodeRun& run) { return run.ring; }
inline std::uint32_t PieceOf(const ShellRun& run) { return run.shell; }
inline std::uint32_t PieceOf(const ParticleSample& sample) { return sample.ring; }
inline std::uint32_t PieceOf(const ShellSample& sample) { return sample.shell; }

/// The row of a run; in space its layer and its row in the layer.
inline std::int32_t RowOf(const NodeRun& run) { return run.row; }
inline std::pair<std::int32_t, std::int32_t> RowOf(const ShellRun& run) {
  return {run.layer, run.row};
}

/// The coordinates of a run's row, and of a sample, by axis. A run lies along axis 0.
inline std::array<std::int32_t*, 1> RowAxesOf(NodeRun& run) { return {&run.row}; }
inline std::array<std::int32_t*, 2> RowAxesOf(ShellRun& run) { return {&run.row, &run.layer}; }
inline std::array<std::int32_t*, 2> AxesOf(ParticleSample& sample) {
  return {&sample.column, &sample.row};
}
inline std::array<std::int32_t*, 3> AxesOf(ShellSample& sample) {
  return {&sample.x, &sample.y, &sample.z};
}

}  // namespace partiemc
