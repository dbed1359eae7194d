// Particles from anywhere in memory, gathered into the arrays of a frame.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/particle_arrays.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

/// A view of `particles` as a frame's message holds them: rows of two or three coordinates, volumes
/// velocities and attributes as float, ids as 64 bits. Nothing is copied until rows are written.
/// Errors: INVALID_ARGUMENT with a Violation (reason COUNT) for coordinates or velocities of which
/// one is missing.
absl::StatusOr<wire::FrameRows> RowsOf(const ParticleArrays& particles, double time);

}  // namespace partiemc::client
