// The most accurate placement: vertices on smoothed planes (core/SURFACES.md, "Placements").
#pragma once

#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space_vertices/body_volumes.h"
#include "space_vertices/loop_windows.h"
#include "space_vertices/roots.h"

namespace partiemc::space {

/// Lengths in spacings, with own sizes in local sizes; in `root` in cells.
struct VirtualPlaneConstants {
  RootConstants root;
  double normal_reach = 2.5;
  double bilateral_reach = 4;
  double bend_reach = 2.5;
  double rounding = 1.0 / 20;  ///< Times R^2 (kappa_1 + kappa_2): the kernel's rounding of bends.
  double smoothing_reach = 4;
  double volume_limit = .4;
};

struct PlacementInput {
  const SpaceBins& bins;
  const SpaceField& field;
  const SpaceCrossings& crossings;
  const Bodies& bodies;
  const Scale& scale;
};

struct VirtualPlaneScratch {
  BodyVolumes volumes;
  LoopWindows windows;
  std::vector<double> bases;          ///< By loop: bends, then the bases of SmoothOnPlanes.
  std::vector<Vec3> smooth, smooth2;  ///< By loop.
};

/// Places the vertices on smoothed planes, sets their normals and matches the volumes of bodies.
/// Lengths are in cells. Requires: FindBodyOfVertices.
void PlaceOnPlanes(const PlacementInput& input, const VirtualPlaneConstants& constants,
                   const std::vector<Vec3>& anchors, VirtualPlaneScratch& scratch,
                   std::vector<Vec3>& positions, std::vector<Vec3>& normals);

}  // namespace partiemc::space
