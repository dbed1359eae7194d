// Gathers particle arrays with arbitrary strides into the arrays of a frame.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/particle_arrays.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

/// Returns a view of `particles` in the layout of a frame's message: rows of two or three
/// coordinates; volumes, velocities and attributes as float; ids as 64 bits. Numbers are copied
/// only when rows are written. Errors: INVALID_ARGUMENT with a Violation (reason COUNT) if one
/// component of coordinates or velocities is missing.
absl::StatusOr<wire::FrameRows> RowsOf(const ParticleArrays& particles, double time);

}  // namespace partiemc::client
