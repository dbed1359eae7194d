// Checks the guarantees R1-R4 of rings (partiemc/result.h). Has helpers of the other checks.
#pragma once

#include <cstddef>
#include <span>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

/// An INTERNAL error whose message is the concatenation of `parts`.
template <typename... Parts>
absl::Status Broken(const Parts&... parts) {
  return absl::InternalError(absl::StrCat(parts...));
}

/// Checks that all coordinates are in the domain of predicates.h. `guarantee`: the name of the
/// broken guarantee in an error, such as "R1".
absl::Status CheckPoints(absl::string_view guarantee, std::span<const double> points);

/// Checks R1-R4, and Rings::contacts with their angles. Cost: n log n in the points.
absl::Status CheckRings(const Rings& rings);

}  // namespace partiemc
