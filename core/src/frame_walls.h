// The walls of the outline of one frame: fixed ones, outlines of wall particles, and the images of
// both in a periodic box.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/internal/research.h"
#include "frame_memory.h"
#include "outline_stages.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/state.h"
#include "prepared_frame.h"
#include "workspace.h"

namespace partiemc {

inline bool HasWalls(const ReconstructionParameters& parameters) {
  return !parameters.walls.empty() || !parameters.wall_phases.empty();
}

/// The parameters of the outline of wall particles. Requires: resolved parameters.
ReconstructionParameters WallParametersOf(const ReconstructionParameters& parameters);

/// Divides a frame that has passed CheckFrame into fluid and walls (Buffers::wall_particles). The
/// fluid decides the lengths of both. Errors: see Reconstructor::Reconstruct.
absl::Status TakeWallParticles(const Frame& given, const ReconstructionParameters& parameters,
                               const State& state, FrameMemory& memory, Workspace::Buffers& buffers,
                               Prepared& prepared);

struct FrameWallsInput {
  const ReconstructionParameters& parameters;
  const ReconstructionParameters* of_walls;  ///< WallParametersOf; null without wall phases.
  const VirtualPlaneVariant& variant;        ///< Of the outline of wall particles.
  const FrameLimits& limits;
  const Frame& fluid;  ///< Lifted, with copies.
  const Prepared& prepared;
  StageObserver* observer;
};

/// Sets `walls` to views of `buffers`. In a periodic box, obstacles and wall particles have images
/// near the fluid. Requires: HasWalls; PrepareFrame with a box; TakeWallParticles with wall phases.
/// Errors: see Reconstructor::Reconstruct. Cost: the outline of the wall particles.
absl::Status FindFrameWalls(const FrameWallsInput& input, FrameMemory& memory,
                            Workspace::Buffers& buffers, FrameWalls& walls);

/// Replaces the number of a particle of the fluid, lifted and copied, by the caller's number in an
/// error about its position. Other errors stay.
absl::Status NamingGivenParticle(const absl::Status& status, const Prepared& prepared,
                                 std::span<const std::uint32_t> fluid_sources);

}  // namespace partiemc
