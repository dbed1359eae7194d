// Reports errors to a program in C.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "partiemc/c/partiemc.h"

namespace partiemc::c {

/// Stores `status` for partiemc_last_error of this thread and returns its code.
partiemc_code Keep(const absl::Status& status);

/// Runs `body` and returns the code of its status. Converts an exception to an error code.
template <typename Body>
partiemc_code Guarded(Body body) noexcept {
  try {
    return Keep(body());
  } catch (const std::bad_alloc&) {
    return Keep(absl::ResourceExhaustedError("out of memory"));
  } catch (const std::exception& error) {
    return Keep(absl::InternalError(error.what()));
  }
}

}  // namespace partiemc::c
