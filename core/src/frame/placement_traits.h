// The table of placements: what each placement requires of the stages.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "partiemc/parameters.h"

namespace partiemc {

struct PlacementTraits {
  Placement placement;
  std::string_view name;
  /// Factor on the reference radius of an axis-aligned lattice. With this factor, outlines of discs
  /// with relaxed particles have a mean offset of 0 (core/METHOD.md, "Calibration"). Linear
  /// interpolation cuts bulges off and needs a larger factor than vertices on the level set.
  double calibration;
  /// Largest distance from an active cell at which the placement samples the field: this number of
  /// cells plus this number of kernel radii.
  double reach_cells, reach_kernels;
  bool on_edges;  ///< One vertex on each crossed lattice edge.
  bool in_cells;  ///< One vertex for each segment, in the segment's cell.
  /// Vertices are particles, and planes go through the weighted means of the cells
  /// (farthest_particle.h). Rings may cross; the mesh connects the middles of the segments.
  bool takes_particles;
  /// Vertices move from the level set along their normals and may leave their cells. Rings are
  /// therefore repaired, and cells that a ring touches are removed from the interior.
  bool refines;
  bool cleans;  ///< The default of ReconstructionParameters::clean.

  double Reach(double kernel_radius) const { return reach_cells + reach_kernels * kernel_radius; }
};

/// Indexed by Placement.
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
