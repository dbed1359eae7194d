// Gathers particle arrays with arbitrary strides into the arrays of a frame.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/particle_arrays.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

/// Returns a view of `particles` in the layout of a frame's message: rows of two or three
/// coordinates; volumes, velocities and attributes as float; ids as 64 bits. Numbers are copied
/// only when rows are written, so the arrays must outlive the view. Errors: INVALID_ARGUMENT with a
/// Violation, if a component is missing (reason COUNT) or `time` is not finite (NOT_FINITE).
absl::StatusOr<wire::FrameRows> RowsOf(const ParticleArrays& particles, double time);

}  // namespace partiemc::client
