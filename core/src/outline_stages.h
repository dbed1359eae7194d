// The stages of one outline: frame -> rings, mesh, attributes and the next state.
#pragma once

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

/// The input of one outline of a frame.
struct OutlineTask {
  const ReconstructionParameters& parameters;
  const VirtualPlaneVariant variant;
  const FrameLimits& limits;
  const Frame& frame;
  const State& previous;
  StageObserver* observer;
  bool is_first;                         ///< The first outline checks the frame.
  const Prepared* prepared;              ///< Null for a frame as given.
  const Rings* wall_outlines = nullptr;  ///< Outlines of wall particles; null without.

  bool HasCopies() const { return prepared != nullptr && prepared->HasCopies(); }
};

/// Computes one outline and its next state; for a stream whose sections have phases, also divides
/// it among them (`buffers.phases`). Errors: see Reconstruct.
absl::Status ReconstructOutline(const OutlineTask& task, FrameMemory& memory,
                                Workspace::Buffers& buffers, NextState& next, Result& result);

/// Writes the outline of a phase, and its next state. `task`: of the outline that was divided, with
/// the state of the phase. Requires: that outline is the last one that was reconstructed. Errors:
/// see Reconstruct.
absl::Status ReconstructPhase(const OutlineTask& task, PhaseLabel label, FrameMemory& memory,
                              Workspace::Buffers& buffers, NextState& next, Result& result);

}  // namespace partiemc
