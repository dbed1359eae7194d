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

namespace partiemc {

/// How the vertices of the outline are placed (paper, sections 3.4-3.5; core/METHOD.md,
/// "Placements").
enum class Placement : std::uint8_t {
  kMarchingSquares,   ///< Linear interpolation of the level set on lattice edges.
  kQef,               ///< Marching squares plus one vertex per cell that minimises Eq. 14.
  kFarthestParticle,  ///< Section 3.5 to the letter: vertices are particles. For comparisons only:
                      ///< rings may cross, triangles may fold.
  kVirtualPlane,      ///< The default: vertices on planes that nearby particles support.
};

/// How the inside of the outline is filled with triangles (paper, sections 3.7-3.8).
enum class Fill : std::uint8_t {
  kNone,    ///< No mesh.
  kGrid,    ///< Two triangles for each interior cell: the paper's "before".
  kGreedy,  ///< Cells merged into rectangles (the paper's "after"); with attributes, into blocks.
  kConforming,  ///< Few triangles, like greedy, but without T-junctions.
  kPolygon,     ///< The rings triangulated, without interior vertices.
};

/// How the particle spacing h is estimated if the caller does not give it.
enum class SpacingRule : std::uint8_t {
  kFirstFrame,  ///< From the first frame whose particles agree on a spacing; then it is kept.
  kEveryFrame,  ///< From each frame that agrees on one. The lattice does not change with it.
};

/// The two of three coordinates that span the plane of the particles.
enum class Plane : std::uint8_t { kXy, kXz, kYz };

/// A plane through particles that fill space. The outline is the section of their body with it.
struct SlicePlane {
  /// A point of the plane, in world units. Results have their coordinates (0, 0) there.
  std::array<double, 3> origin{};
  /// Normal of the plane, of any length except 0. It decides the axes of results:
  ///   along z: x and y; along -y: x and z; along x: y and z.
  /// For any other normal, the first axis is the projection of x onto the plane, or of y if the
  /// normal is closer to the x axis than to y and z. The second axis completes a right-handed
  /// system with the normal.
  std::array<double, 3> normal{0, 0, 1};

  friend bool operator==(const SlicePlane&, const SlicePlane&) = default;
};

/// One more outline of the same particles, with the other parameters of the stream.
struct Section {
  /// Absent: the slice of the stream. Requires a slice there.
  std::optional<SlicePlane> slice = std::nullopt;
  std::optional<double> isovalue = std::nullopt;  ///< Absent: the outline of the body.

  friend bool operator==(const Section&, const Section&) = default;
};

struct ReconstructionParameters {
  Placement placement = Placement::kVirtualPlane;
  Fill fill = Fill::kGreedy;

  /// Limits of the spacing: squares and products of lengths neither overflow nor underflow.
  static constexpr double kMinSpacing = 1e-60, kMaxSpacing = 1e60;

  /// Particle spacing h in world units, in [1e-60, 1e60]. Give it if you know it, as a simulator
  /// does. Absent: estimated as `spacing_rule` says. The lengths below are multiples of it.
  std::optional<double> spacing = std::nullopt;
  SpacingRule spacing_rule = SpacingRule::kFirstFrame;

  /// Kernel radius R in spacings, in [1.5, 8]. A larger one smooths the outline and costs its
  /// square; a smaller one follows single particles.
  double kernel_radius = 3.0;

  /// Lattice spacing in spacings, in [0.25, 4]. A smaller one resolves more and costs its inverse
  /// square.
  double cell_size = 1.0;

  /// Reference radius r of the level set in spacings, in (0, kernel_radius). A larger one moves the
  /// outline outward by the difference. Absent: calibrated for the placement and kernel radius, so
  /// that a flat boundary lies h/2 outside the outermost layer (core/METHOD.md, "Calibration").
  std::optional<double> reference_radius = std::nullopt;

  /// `farthest-particle` only: moves vertices outward by this many spacings, in [-1, 1]. 0 is the
  /// paper; 0.5 matches the volume.
  double surface_offset = 0.0;

  /// Largest error of attributes in the mesh of `greedy`, a fraction in [0, 1] of the attribute's
  /// range over the particles (METHOD.md, "Mesh"). The mesh has no T-junctions. 1: rectangles as in
  /// frames without attributes.
  double attribute_tolerance = 0.01;

  /// Orient cell normals by the normals of the frame before (Eq. 11), not by the outline alone.
  bool normal_memory = true;

  /// Close holes smaller than 2 h^2 and drop components without particles. Absent: on for
  /// `virtual-plane`, off for the other placements.
  std::optional<bool> clean = std::nullopt;

  /// Spray: drops components that enclose less area than this, in squared spacings (a lone particle
  /// has about 2), or fewer particles than this, with everything inside them. The number dropped is
  /// FrameStatistics::dropped_spray. At least 0; 0 keeps all.
  double min_component_area = 0;
  std::uint64_t min_component_particles = 0;

  /// The plane of positions with three components; ignored for two.
  Plane plane = Plane::kXy;

  /// Particles fill space and the outline is a section of their body (core/METHOD.md, "Slices").
  /// Positions have three components, distances are measured in space, volumes replace areas (h^3
  /// replaces h^2). Particles farther from the plane than the kernel radius have no effect.
  /// Requires `spacing` and a placement that keeps guarantees; `plane` is ignored.
  std::optional<SlicePlane> slice = std::nullopt;

  static constexpr double kMinIsovalue = 0.01, kMaxIsovalue = 10;

  /// The outline is the isoline of the density at this value, in [0.01, 10], instead of F = 0
  /// (core/METHOD.md, "Isolines of the density"). The density is sum V_i W: about 1 inside a body,
  /// 1/2 on a flat boundary. Vertices lie on the isoline; `reference_radius` is ignored. Requires a
  /// placement that keeps guarantees.
  std::optional<double> isovalue = std::nullopt;

  static constexpr std::size_t kMaxSections = 16;

  /// More outlines of each frame (Result::sections), at most 16. Each costs another frame without
  /// the checks of the input.
  std::vector<Section> sections = {};

  friend bool operator==(const ReconstructionParameters&,
                         const ReconstructionParameters&) = default;
};

/// Checks every field. Errors: INVALID_ARGUMENT with the Violation of the first broken rule.
absl::Status Validate(const ReconstructionParameters& parameters);

/// Replaces every absent optional except `spacing` by the value that applies.
/// Requires: Validate(parameters).ok().
ReconstructionParameters Resolve(ReconstructionParameters parameters);

/// Whether results of this placement have all guarantees of result.h: rings are simple and nested,
/// triangles are not folded. False for `farthest-particle` only, which is exempt from R2, R3, R4,
/// M1 and M2, and which slices and isovalues exclude.
bool KeepsGuarantees(Placement placement);

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
