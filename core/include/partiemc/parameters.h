// The parameters of a reconstruction: fixed for a stream, checked once when it opens.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/virtual_plane_constants.h"

namespace partiemc {

/// Where the vertices of the isoline go (paper, sections 3.4-3.5; core/METHOD.md, "Placements").
enum class Placement : std::uint8_t {
  kMarchingSquares,   ///< Linear interpolation of the level set on lattice edges.
  kQef,               ///< Marching squares plus one vertex per cell that minimises Eq. 14.
  kFarthestParticle,  ///< Section 3.5 to the letter: the farthest particle above the plane.
  kVirtualPlane,      ///< The default: vertices on planes that the particles near them support.
};

/// How the inside of the isoline is filled with triangles (paper, sections 3.7-3.8).
enum class Fill : std::uint8_t {
  kNone,        ///< No mesh at all.
  kGrid,        ///< Two triangles for each interior cell: the paper's "before".
  kGreedy,      ///< Interior cells merged into rectangles: the paper's "after".
  kConforming,  ///< As few triangles as greedy, and no T-junction.
  kPolygon,     ///< The rings triangulated, without any interior vertex.
};

/// Where the particle spacing h comes from when the caller does not give it.
enum class SpacingRule : std::uint8_t {
  kFirstFrame,  ///< Estimated from the first frame whose particles agree on one, then kept.
  kEveryFrame,  ///< Of each frame that agrees on one; it changes the radii, never the lattice.
};

/// What the steps of `virtual-plane` are made of (core/METHOD.md, "The default placement"). All on
/// is the method; each can be switched off, so that `evaluate` can show what it is worth. Not on
/// the wire.
struct VirtualPlaneSteps {
  bool edge_vertices = true;  ///< A vertex on each crossed lattice edge, beside the cell's.
  bool normals = true;        ///< Normals smoothed along the ring, the second time bilaterally.
  bool curvature = true;      ///< Undo the kernel's rounding of curved boundaries.
  bool support = true;        ///< Shift planes to the particles that support them.
  bool smoothing = true;      ///< Vertices smoothed along the ring, across no corner.
  bool area = true;           ///< Match the particles' volumes where they are known.

  /// One vertex per cell, one Newton step from the middle of its segment, and nothing else.
  static constexpr VirtualPlaneSteps None() { return {false, false, false, false, false, false}; }

  friend bool operator==(const VirtualPlaneSteps&, const VirtualPlaneSteps&) = default;
};

/// Which two of three coordinates span the plane of the particles.
enum class Plane : std::uint8_t { kXy, kXz, kYz };

/// A plane through particles in space, on which the outline is the section of the body.
struct SlicePlane {
  /// A point of the plane, in world units: where the coordinates of results are 0.
  std::array<double, 3> origin{};
  /// Any length but 0. Along z, results have the axes x and y; along -y, x and z; along x, y and z;
  /// else the first axis is x as the plane sees it, or y where the normal leans to x more than to y
  /// and z, and the second stands upright on it, so that the normal points at whoever sees the
  /// first on the right of the second.
  std::array<double, 3> normal{0, 0, 1};

  friend bool operator==(const SlicePlane&, const SlicePlane&) = default;
};

/// One more outline of the same particles, with the same parameters but for what stands here.
struct Section {
  /// Absent: that of the parameters. Wants one there: particles fill space or lie in a plane.
  std::optional<SlicePlane> slice = std::nullopt;
  std::optional<double> isovalue = std::nullopt;  ///< Absent: the outline of the body.

  friend bool operator==(const Section&, const Section&) = default;
};

struct ReconstructionParameters {
  Placement placement = Placement::kVirtualPlane;
  Fill fill = Fill::kGreedy;

  /// The widest range of spacings whose squares and products neither overflow nor underflow.
  static constexpr double kMinSpacing = 1e-60, kMaxSpacing = 1e60;

  /// Particle spacing h in world units, in [1e-60, 1e60]. The normal case: a simulator knows it.
  /// Every other length below is a multiple of it. Absent: estimated as `spacing_rule` says.
  std::optional<double> spacing = std::nullopt;
  SpacingRule spacing_rule = SpacingRule::kFirstFrame;

  /// Kernel radius R in spacings, in [1.5, 8]. More smooths the outline and costs its square;
  /// less follows single particles.
  double kernel_radius = 3.0;

  /// Lattice spacing in spacings, in [0.25, 4]. Less resolves more and costs its inverse square.
  double cell_size = 1.0;

  /// Reference radius r of the level set in spacings, in (0, kernel_radius): more moves the outline
  /// outward by as much. Absent: calibrated for the placement and kernel radius, so that a flat
  /// boundary lies h/2 outside the outermost layer of particles (core/METHOD.md, "Calibration").
  std::optional<double> reference_radius = std::nullopt;

  /// `farthest-particle` only: vertices move outward by this many spacings, in [-1, 1]. 0 is the
  /// paper; 0.5 puts the outline where the volume is.
  double surface_offset = 0.0;

  /// Orient the cell normals by those of the frame before (Eq. 11); otherwise by the isoline alone.
  bool normal_memory = true;

  /// Close holes of less than 2 h^2, drop components that hold no particle. Absent: as the
  /// placement wants it (on for `virtual-plane`, off for the others).
  std::optional<bool> clean = std::nullopt;

  VirtualPlaneSteps steps;
  VirtualPlaneConstants constants;

  /// Components that enclose less area than this many squared spacings, at least 0 (a lone
  /// particle's has about 2), or fewer particles than this, are dropped with everything in them,
  /// and counted (FrameStatistics::dropped_spray). 0: keep all.
  double min_component_area = 0;
  std::uint64_t min_component_particles = 0;

  /// The plane of positions with three components; positions with two are taken as they are.
  Plane plane = Plane::kXy;

  /// Positions have three components and fill space: the outline is that of a section. Distances
  /// are those of space, h^3 takes the place of h^2, volumes are volumes; particles farther from
  /// the plane than the kernel reaches do not count. Wants `spacing`, and any placement but
  /// `farthest-particle`; `plane` does not matter (core/METHOD.md, "Slices").
  std::optional<SlicePlane> slice = std::nullopt;

  static constexpr double kMinIsovalue = 0.01, kMaxIsovalue = 10;

  /// The outline is the isoline of the density at this value, in [0.01, 10], in place of the level
  /// set: the density, sum V_i W, is about 1 inside of bodies and 1/2 on a flat boundary.
  /// `reference_radius` does not matter then, and vertices stay on the isoline. Any placement but
  /// `farthest-particle` (core/METHOD.md, "Isolines of the density").
  std::optional<double> isovalue = std::nullopt;

  /// More outlines of each frame (Result::sections), at most 16. Each costs a frame of its own,
  /// but for the checks.
  static constexpr std::size_t kMaxSections = 16;
  std::vector<Section> sections = {};

  friend bool operator==(const ReconstructionParameters&,
                         const ReconstructionParameters&) = default;
};

/// OK, or INVALID_ARGUMENT with the Violation of the first field that breaks its rule.
absl::Status Validate(const ReconstructionParameters& parameters);

/// `parameters` with every absent optional but `spacing` replaced by the value that will be used.
/// Requires: Validate(parameters).ok().
ReconstructionParameters Resolve(ReconstructionParameters parameters);

/// The names used on command lines, in files and in reports: "marching-squares", "greedy", ...
std::string_view Name(Placement placement);
std::string_view Name(Fill fill);
std::string_view Name(SpacingRule rule);
std::string_view Name(Plane plane);
std::span<const Placement> AllPlacements();
std::span<const Fill> AllFills();
std::optional<Placement> FindPlacement(std::string_view name);
std::optional<Fill> FindFill(std::string_view name);

}  // namespace partiemc
