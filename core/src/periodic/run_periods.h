// Wraps runs of lattice nodes into a periodic box.
//
// A period need not be a whole number of cells, so a node moves by the nearest whole number. The
// error of half a cell hardly changes the number of nodes that two rings share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "partiemc/parameters.h"

namespace partiemc {

/// Lengths of a periodic box along x, y, z, in cells; 0: not periodic. In a plane, x and y are its
/// axes.
struct LatticePeriods {
  std::array<double, 3> cells{};

  bool Any() const { return cells != std::array<double, 3>{}; }
};

/// The number of cells by which a node at `at` moves back into the box [0, period). The true origin
/// of the box does not matter, because both frames are wrapped alike.
inline std::int64_t WrapOf(double period, std::int64_t at) {
  if (period == 0) return 0;
  const double image = std::floor(static_cast<double>(at) / period);
  return static_cast<std::int64_t>(std::floor(image * period + 0.5));
}

/// Splits the run [first, last] at faces of boxes. Calls visit(first, last) for each wrapped part.
/// A longer run than a period counts as one period, so there are at most three parts: runs of an
/// untrusted state may have any length.
template <typename Visit>
void ForEachWrapped(double period, std::int64_t first, std::int64_t last, const Visit& visit) {
  if (period == 0) {
    visit(static_cast<std::int32_t>(first), static_cast<std::int32_t>(last));
    return;
  }
  last = std::min(last, first + static_cast<std::int64_t>(std::ceil(period)) - 1);
  while (first <= last) {
    const double image = std::floor(static_cast<double>(first) / period);
    // The last node below the upper face of this box.
    const auto face = static_cast<std::int64_t>(std::ceil((image + 1) * period)) - 1;
    const std::int64_t end = std::clamp(face, first, last);
    const std::int64_t wrap = WrapOf(period, first);
    visit(static_cast<std::int32_t>(first - wrap), static_cast<std::int32_t>(end - wrap));
    first = end + 1;
  }
}

}  // namespace partiemc
