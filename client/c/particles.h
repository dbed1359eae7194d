// Converts the arrays of a C program to the client's arrays.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/c/partiemc.h"
#include "partiemc/client/particle_arrays.h"

namespace partiemc::c {

/// Returns a view of `particles`; fills `attributes` and refers to it. Errors: INVALID_ARGUMENT
/// with a Violation (reason UNSUPPORTED) for a type that the array must not have, (reason COUNT)
/// for an array without an address.
absl::StatusOr<client::ParticleArrays> ArraysOf(const partiemc_particles* particles,
                                                std::vector<client::AttributeArrays>& attributes);

}  // namespace partiemc::c
