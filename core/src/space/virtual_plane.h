// The default placement: vertices on smoothed planes (core/SURFACES.md, "Placements").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"

namespace partiemc::space {

/// Lengths in spacings.
struct VirtualPlaneConstants {
  double normal_reach = 2.5;
  double bilateral_reach = 4;
  double curvature_reach = 2.5;
  double rounding = 1.0 / 20;  ///< Times R^2 (kappa_1 + kappa_2): the kernel's rounding of bends.
  double smoothing_reach = 4;
  double volume_limit = .2;
  double spray_area = 45;  ///< Bodies with a smaller surface are spray, in squared spacings.
};

struct VirtualPlaneInput {
  const BrickDirectory& bricks;
  const SpaceField& field;
  const SpaceCrossings& crossings;
  const Bodies& bodies;
  const Scale& scale;
  const std::vector<std::uint8_t>& is_fixed;
  const VirtualPlaneConstants& constants;
};

struct VirtualPlaneScratch {
  /// By loop (vertex minus edge_count): its neighbours across faces, in [first, next first).
  std::vector<std::uint32_t> neighbour_first, neighbours;
  /// By loop: the loops in its largest window, likewise.
  std::vector<std::uint32_t> window_first, windows;
  std::vector<std::vector<std::uint32_t>> found;  ///< By task.
  std::vector<double> areas, base;                ///< By loop.
  std::vector<Vec3> before, smoothed;             ///< By vertex.
  std::vector<std::uint32_t> body_of;             ///< By vertex.

  struct Measure {
    double area = 0, volume = 0;
    Vec3 moment;  ///< Of the volume.
    Vec3 origin;  ///< A vertex of the body.
    bool is_started = false;
  };
  std::vector<Measure> measures;  ///< By body.
};

/// Moves the roots to their places and replaces their normals. `anchors` in cells. Bodies below
/// `spray_area` return to their anchors and are scaled to the volume of their particles.
void PlaceOnPlanes(const VirtualPlaneInput& input, const std::vector<Vec3>& anchors,
                   VirtualPlaneScratch& scratch, std::vector<Vec3>& positions,
                   std::vector<Vec3>& normals);

}  // namespace partiemc::space
