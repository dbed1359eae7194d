// The checks of rings, and what they share with those of meshes (partiemc/validate.h).
#pragma once

#include <cstddef>
#include <span>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

template <typename... Parts>
absl::Status Broken(const Parts&... parts) {
  return absl::InternalError(absl::StrCat(parts...));
}

/// OK if all coordinates are finite and in the domain of the predicates; `guarantee` names what is
/// broken if not.
absl::Status CheckPoints(absl::string_view guarantee, std::span<const double> points);

/// Guarantees R1-R4.
absl::Status CheckRings(const Rings& rings);

}  // namespace partiemc
