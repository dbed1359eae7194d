// The steps and constants of the default placement (`virtual-plane`), and variants of them. Frames
// use the default values, and the server hashes these into checkpoints. A change of a default value
// therefore needs a new kMethodVersion. Variants are experiments: only the evaluation, the tests
// and this repository's Python module create them (CreateVariant). Not installed. Requests cannot
// set steps or constants. Programs use Reconstructor::Create.
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"

namespace partiemc {

/// The steps of `virtual-plane` (core/METHOD.md, "The default placement"). By default, all steps
/// are on.
struct VirtualPlaneSteps {
  bool edge_vertices = true;  ///< Vertices on crossed lattice edges, not only in cells.
  bool normals = true;        ///< Normals smoothed along the ring, the second time bilaterally.
  bool curvature = true;      ///< Undo the kernel's rounding of curved boundaries.
  bool support = true;        ///< Shift planes to the particles that support them.
  bool smoothing = true;      ///< Vertices smoothed along the ring, but not across corners.
  bool area = true;           ///< Match the particles' area, if volumes or the spacing are given.

  /// No step: one vertex per cell, placed by one Newton step from the middle of its segment.
  static constexpr VirtualPlaneSteps None() { return {false, false, false, false, false, false}; }

  friend bool operator==(const VirtualPlaneSteps&, const VirtualPlaneSteps&) = default;
};

/// The constants of `virtual-plane`. core/METHOD.md, "The default placement", gives the purpose,
/// the reason and the effect of each. Lengths are in spacings unless noted otherwise.
struct VirtualPlaneConstants {
  // 1. Roots.
  double newton_step = 0.3;  ///< Longest Newton step, in cells.
  double long_step = 0.07;   ///< In cells. After a longer step the gradient is evaluated again.
  // 2. Normals.
  double normal_reach = 3;     ///< Window of the mean by distance along the ring.
  double bilateral_reach = 6;  ///< Window of the mean by distance and angle.
  // 3. Planes.
  double curvature_reach = 2;       ///< Window of the curvature fit.
  double rounding = 0.5;            ///< The kernel moves a bend inward by this times R^2 kappa / 9.
  double support_radius = 2;        ///< Particles within this distance may support a plane.
  double support_depth = 2;         ///< Particles deeper below the plane have no weight.
  double support_height = 0.6;      ///< Higher particles do not count; limits the shift.
  double support_scatter = 0.01;    ///< Variance in h^2 at which the support counts half.
  double smoothing_reach = 3;       ///< Window of the mean of the neighbours' planes.
  double thinning_distance = 0.01;  ///< Edge vertices nearer to the chord are removed.
  // 4. Area.
  double area_limit = 0.2;    ///< Largest offset.
  double area_change = 0.01;  ///< Largest change of the offset per frame.

  /// Length of the shortest ring with windows, in spacings. A window along a shorter ring would
  /// overlap itself, so the vertices of shorter rings stay at their roots. Components whose outer
  /// ring is shorter do not count for the area.
  double ShortestRing() const {
    return 2 * std::max({normal_reach, bilateral_reach, curvature_reach, smoothing_reach});
  }

  friend bool operator==(const VirtualPlaneConstants&, const VirtualPlaneConstants&) = default;
};

/// A form of `virtual-plane`; by default the method itself.
struct VirtualPlaneVariant {
  VirtualPlaneSteps steps;
  VirtualPlaneConstants constants;

  friend bool operator==(const VirtualPlaneVariant&, const VirtualPlaneVariant&) = default;
};

struct NamedStep {
  std::string_view name;  ///< "edge-vertices", ...
  bool VirtualPlaneSteps::*value;
};

struct NamedConstant {
  std::string_view name;  ///< "normal-reach", ...
  double VirtualPlaneConstants::*value;
};

/// All steps and all constants, in the order of the members.
std::span<const NamedStep> AllSteps();
std::span<const NamedConstant> AllConstants();

/// Like Reconstructor::Create, for a variant of `virtual-plane`; other placements ignore `variant`.
/// Requires: constants are positive and finite. Errors: as Reconstructor::Create.
absl::StatusOr<Reconstructor> CreateVariant(const ReconstructionParameters& parameters,
                                            const VirtualPlaneVariant& variant,
                                            const FrameLimits& limits = {});

/// Returns `variant` without the steps that `parameters` rule out. A slice has no known area, its
/// rings do not show how the body bends across the plane, and the outermost layer leans there. The
/// steps area, curvature and support are therefore off. For an isovalue, smoothing is off, too, so
/// that the vertices stay on the isoline. With grains, only the roots and `edge_vertices` remain.
VirtualPlaneVariant VariantFor(const ReconstructionParameters& parameters,
                               VirtualPlaneVariant variant);

}  // namespace partiemc
