// Arrays of a program in C as the client takes them.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/c/partiemc.h"
#include "partiemc/client/particle_arrays.h"

namespace partiemc::c {

/// A view of `particles`, and of `attributes`, which it fills.
/// Errors: INVALID_ARGUMENT with a Violation (reason UNSUPPORTED) for a type that an array may not
/// have, (reason COUNT) for one without an address.
absl::StatusOr<client::ParticleArrays> ArraysOf(const partiemc_particles* particles,
                                                std::vector<client::AttributeArrays>& attributes);

}  // namespace partiemc::c
