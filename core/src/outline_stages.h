// The stages of one outline: frame -> rings, mesh, attributes and the next state.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "core/internal/research.h"
#include "frame_memory.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "phases/phase_field.h"
#include "prepared_frame.h"
#include "workspace.h"

namespace partiemc {

/// The walls of a frame (frame_walls.h).
struct FrameWalls {
  std::span<const Wall> fixed = {};
  bool are_obstacles = false;  ///< Polygons of `fixed` are obstacles, however they are oriented.
  const Rings* of_particles = nullptr;  ///< Outlines of wall particles; null: none.

  bool Any() const {
    return !fixed.empty() || (of_particles != nullptr && of_particles->RingCount() > 0);
  }
};

/// The input of one outline of a frame.
struct OutlineTask {
  const ReconstructionParameters& parameters;
  const VirtualPlaneVariant variant;
  const FrameLimits& limits;
  const Frame& frame;
  const State& previous;
  StageObserver* observer;
  bool is_first;             ///< Whether this outline has to check the frame.
  const Prepared* prepared;  ///< Null: `frame` is the given frame.
  FrameWalls walls = {};

  bool HasCopies() const { return prepared != nullptr && prepared->HasCopies(); }
};

/// Computes one outline and its next state. If sections of `task.parameters` have phases, also
/// divides the outline among them (`buffers.phases`). Errors: see Reconstruct.
absl::Status ReconstructOutline(const OutlineTask& task, FrameMemory& memory,
                                Workspace::Buffers& buffers, NextState& next, Result& result);

/// Writes the outline of one phase, and its next state. `task`: as for the outline that was
/// divided, but with the state of the phase. Requires: ReconstructOutline was last called for that
/// outline. Errors: see Reconstruct.
absl::Status ReconstructPhase(const OutlineTask& task, PhaseLabel label, FrameMemory& memory,
                              Workspace::Buffers& buffers, NextState& next, Result& result);

}  // namespace partiemc
