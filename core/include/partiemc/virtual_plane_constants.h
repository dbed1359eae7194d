// Every number that shapes `virtual-plane`, in one place.
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

namespace partiemc {

/// The constants of the default placement. core/METHOD.md, "The default placement", says what each
/// does, why it has its value and what it is worth. Lengths are in spacings unless told otherwise.
/// Not on the wire: `evaluate --sensitivity` varies them, everyone else leaves them as they are.
struct VirtualPlaneConstants {
  // 1. Roots.
  double newton_step = 0.3;  ///< Longest step from the lattice's contour to the root, in cells.
  double long_step = 0.07;   ///< After a longer step the gradient is asked for again, in cells.
  // 2. Normals.
  double normal_reach = 3;     ///< Of the mean by distance along the ring.
  double bilateral_reach = 6;  ///< Of the mean by distance and angle.
  // 3. Planes.
  double curvature_reach = 2;
  double rounding = 0.5;            ///< By so many R^2 / 9 kappa the kernel rounds a bend off.
  double support_radius = 2;        ///< Particles nearer than this support a plane,
  double support_depth = 2;         ///< unless they lie farther below it than this.
  double support_height = 0.6;      ///< Nor are those above this its own; no estimate exceeds it.
  double support_scatter = 0.01;    ///< Half of a support is believed at this variance, in h^2.
  double smoothing_reach = 3;       ///< Of the mean of what the neighbours' planes say.
  double thinning_distance = 0.01;  ///< Of edge vertices that go, from their neighbours' chord.
  // 4. Area.
  double area_limit = 0.2;    ///< Longest offset.
  double area_change = 0.01;  ///< Largest change of the offset in a frame.

  /// Windows along a ring must not meet their own ends: shorter rings stay at their roots, and
  /// their components are not asked for their area.
  double ShortestRing() const {
    return 2 * std::max({normal_reach, bilateral_reach, curvature_reach, smoothing_reach});
  }

  friend bool operator==(const VirtualPlaneConstants&, const VirtualPlaneConstants&) = default;
};

/// A constant by its name.
struct NamedConstant {
  std::string_view name;  ///< "normal-reach", ...
  double VirtualPlaneConstants::*value;
};

/// All of them, in their order.
std::span<const NamedConstant> AllConstants();

}  // namespace partiemc
