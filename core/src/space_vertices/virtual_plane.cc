#include "space_vertices/virtual_plane.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "space_vertices/edge_vertices.h"
#include "space_vertices/loop_filters.h"

namespace partiemc::space {
namespace {

/// The local sizes by loop; empty for equal sizes.
std::span<const float> LoopSizes(const PlacementInput& input, const VirtualPlaneScratch& scratch) {
  const std::span<const float> sizes(scratch.volumes.sizes);
  return sizes.empty() ? sizes : sizes.subspan(input.crossings.edge_count);
}

/// Moves the vertices in cells to smoothed planes and replaces their normals.
void SmoothLoops(const PlacementInput& input, const VirtualPlaneConstants& constants,
                 VirtualPlaneScratch& scratch, std::span<Vec3> centres, std::span<Vec3> normals) {
  const double h = input.scale.spacing;
  const std::span<const float> sizes = LoopSizes(input, scratch);
  const LoopSurface surface{scratch.windows, centres, scratch.volumes.areas, sizes};
  scratch.smooth.resize(centres.size());
  scratch.smooth2.resize(centres.size());
  scratch.bases.resize(centres.size());
  SmoothNormals(surface, normals, constants.normal_reach * h, Stop::kNowhere, scratch.smooth);
  SmoothNormals(surface, scratch.smooth, constants.bilateral_reach * h, Stop::kAtEdges,
                scratch.smooth2);
  SmoothNormals(surface, scratch.smooth2, constants.bilateral_reach * h, Stop::kAtEdges, normals);

  FindBends(surface, normals, constants.bend_reach * h, 2 / h, scratch.bases);
  const double radius = input.scale.kernel_radius;
  for (std::size_t loop = 0; loop < scratch.bases.size(); ++loop) {
    const double size = surface.SizeOf(loop);
    scratch.bases[loop] *= constants.rounding * radius * radius * (size * size);
  }
  SmoothOnPlanes(surface, normals, scratch.bases, constants.smoothing_reach * h, scratch.smooth);
  std::copy(scratch.smooth.begin(), scratch.smooth.end(), centres.begin());
}

}  // namespace

void PlaceOnPlanes(const PlacementInput& input, const VirtualPlaneConstants& constants,
                   const std::vector<Vec3>& anchors, VirtualPlaneScratch& scratch,
                   std::vector<Vec3>& positions, std::vector<Vec3>& normals) {
  const BrickDirectory& bricks = input.bins.bricks;
  const SpaceCrossings& crossings = input.crossings;
  const double h = input.scale.spacing, cell_size = input.scale.cell_size;
  std::vector<float>& sizes = scratch.volumes.sizes;
  sizes.assign(input.scale.has_own_sizes ? anchors.size() : 0, 1);
  MeasureBodies(bricks, crossings, cell_size, input.bodies, anchors, scratch.volumes);

  positions = anchors;
  FindRoots(input.bins, input.scale, crossings, constants.root, positions, normals, sizes);
  const auto centres = std::span(positions).subspan(crossings.edge_count);
  const double reach = std::max({constants.normal_reach, constants.bilateral_reach,
                                 constants.bend_reach, constants.smoothing_reach});
  FindWindows(bricks, crossings, centres, reach * h, scratch.windows, LoopSizes(input, scratch));
  SmoothLoops(input, constants, scratch, centres, std::span(normals).subspan(crossings.edge_count));
  PlaceEdgesByLoops(bricks, crossings, anchors, positions, normals, sizes);

  // One round misses the volume of small bodies, because their area changes as they move.
  for (int round = 0; round < 2; ++round) {
    MeasureBodies(bricks, crossings, cell_size, input.bodies, positions, scratch.volumes);
    MatchVolumes(input.bodies, {.unit = cell_size, .limit = constants.volume_limit * h}, normals,
                 scratch.volumes, positions);
  }
}

}  // namespace partiemc::space
