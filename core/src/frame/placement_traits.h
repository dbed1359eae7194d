// What each placement needs of the stages: a row of one table.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "partiemc/parameters.h"

namespace partiemc {

struct PlacementTraits {
  Placement placement;
  std::string_view name;
  /// Times the reference radius of an axis-aligned lattice: what a whole chain wants for no mean
  /// offset on discs under relaxed sampling (core/METHOD.md, "Calibration"). Linear interpolation
  /// cuts the contour's bulge off and so wants more, vertices on the level set less.
  double calibration;
  /// How far from active cells it samples the field: so many cells, and so many kernel radii.
  double reach_cells, reach_kernels;
  bool on_edges;  ///< A vertex on each crossed lattice edge,
  bool in_cells;  ///< and one for each cell.
  /// Vertices are particles, planes go through the weighted means of the cells
  /// (farthest_particle.h). Rings may cross; the mesh connects the middles of the segments.
  bool takes_particles;
  /// Vertices move along their rings, from the level set to where their surroundings put them, and
  /// out of their cells: rings are repaired, and the interior loses the cells that they touch.
  bool refines;
  bool cleans;  ///< ReconstructionParameters::clean, where that is absent.

  double Reach(double kernel_radius) const { return reach_cells + reach_kernels * kernel_radius; }
};

/// By the number of the placement.
inline constexpr std::array<PlacementTraits, 4> kPlacements = {{
    {.placement = Placement::kMarchingSquares,
     .name = "marching-squares",
     .calibration = 1.09,
     .on_edges = true},
    {.placement = Placement::kQef,
     .name = "qef",
     .calibration = 1.085,
     .on_edges = true,
     .in_cells = true},
    {.placement = Placement::kFarthestParticle,
     .name = "farthest-particle",
     .calibration = 1.0,
     .reach_cells = 1,
     .reach_kernels = 1,
     .in_cells = true,
     .takes_particles = true},
    {.placement = Placement::kVirtualPlane,
     .name = "virtual-plane",
     .calibration = 1.05,
     .reach_cells = 2,
     .on_edges = true,
     .in_cells = true,
     .refines = true,
     .cleans = true},
}};

constexpr const PlacementTraits& TraitsOf(Placement placement) {
  return kPlacements[static_cast<std::size_t>(placement)];
}
static_assert([] {
  for (const PlacementTraits& traits : kPlacements) {
    if (TraitsOf(traits.placement).placement != traits.placement) return false;
  }
  return true;
}());

}  // namespace partiemc
