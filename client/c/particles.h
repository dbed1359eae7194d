// Converts the arrays of a C program to the client's arrays.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/c/partiemc.h"
#include "partiemc/client/particle_arrays.h"
#include "partiemc/parameters.h"

namespace partiemc::c {

/// Returns a view of the program's arrays. The view also refers to `attributes`, which this
/// function fills. Errors: INVALID_ARGUMENT with a Violation. Reason UNSUPPORTED: an array has an
/// element type that is not allowed for it. Reason COUNT: an array, `particles` or its member
/// `attributes` has no address.
absl::StatusOr<client::ParticleArrays> ArraysOf(const partiemc_particles* particles,
                                                std::vector<client::AttributeArrays>& attributes);

/// `numbers`: lower end and length of the axes x, y and z; an axis of length 0 is not periodic.
/// Null: no box.
std::optional<PeriodicBox> BoxOf(const double* numbers);

}  // namespace partiemc::c
