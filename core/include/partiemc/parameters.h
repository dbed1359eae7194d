// The parameters of a reconstruction: fixed for a stream, checked once when it opens.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace partiemc {

/// The kind of a frame's result.
enum class Output : std::uint8_t {
  kOutline,  ///< Rings and their mesh in a plane (core/METHOD.md).
  kSurface,  ///< Closed surfaces in space (core/SURFACES.md).
};

/// How the vertices of the outline are placed (paper, sections 3.4-3.5; core/METHOD.md,
/// "Placements").
enum class Placement : std::uint8_t {
  kMarchingSquares,   ///< Linear interpolation of the level set on lattice edges; for surfaces,
                      ///< marching cubes.
  kQef,               ///< Marching squares plus one vertex per segment that minimises Eq. 14; for
                      ///< surfaces, dual contouring.
  kFarthestParticle,  ///< Section 3.5 to the letter: vertices are particles. For comparisons only:
                      ///< rings may cross, triangles may fold.
  kVirtualPlane,      ///< The default: vertices on planes that nearby particles support.
};

/// How the inside of the outline is filled with triangles (paper, sections 3.7-3.8).
enum class Fill : std::uint8_t {
  kNone,    ///< No mesh.
  kGrid,    ///< Two triangles for each interior cell: the paper's mesh before merging.
  kGreedy,  ///< Interior cells merged to rectangles, as in the paper. If the frame has attributes
            ///< and `attribute_tolerance` is below 1: to square blocks of 1 to 32 cells a side.
  kConforming,  ///< Few triangles, like greedy, but without T-junctions.
  kPolygon,     ///< The rings triangulated, without interior vertices.
};

/// How the particle spacing h is estimated if the caller does not give it.
enum class SpacingRule : std::uint8_t {
  kFirstFrame,  ///< From the first frame whose particles agree on a spacing; later frames keep it.
  kEveryFrame,  ///< From each frame whose particles agree on a spacing; other frames keep the last
                ///< one. The lattice of the first such frame stays.
};

/// How the size h_i of a particle is determined. The size replaces h for this particle.
enum class Sizes : std::uint8_t {
  kEqual,  ///< The spacing h, for all particles.
  kOwn,    ///< h_i = sqrt(v_i), for surfaces cbrt(v_i), with v_i of Frame::volumes (core/SIZES.md).
};

/// The shape that the outline surrounds.
enum class Boundary : std::uint8_t {
  kBulk,    ///< The body that the particles fill: the outline smooths over single particles.
  kGrains,  ///< Particles are discs of the diameter h_i, and the outline follows their surfaces
            ///< (core/SIZES.md, "Grains").
};

/// The plane in which the particles lie, by the two coordinates that span it.
enum class Plane : std::uint8_t { kXy, kXz, kYz };

/// A plane that cuts the body of particles that fill space. The outline is the section of the body
/// with this plane.
struct SlicePlane {
  /// A point of the plane, in world units: the origin of the coordinates in results.
  std::array<double, 3> origin{};
  /// Normal of the plane, of any length except 0. The normal determines the axes of results:
  ///   normal along z: x and y; along -y: x and z; along x: y and z.
  /// For any other normal, the first axis is the projection of the x axis onto the plane, or of the
  /// y axis if the normal is closer to x than to y and z. The second axis completes a right-handed
  /// system with the normal.
  std::array<double, 3> normal{0, 0, 1};

  friend bool operator==(const SlicePlane&, const SlicePlane&) = default;
};

/// Another outline of the same particles, with the parameters of the stream except the members of
/// this struct. At most one member is present; a slice and an isovalue may be combined.
struct Section {
  /// Absent: the slice of the stream. Required for Output::kSurface; otherwise allowed only if the
  /// stream has a slice.
  std::optional<SlicePlane> slice = std::nullopt;
  /// Absent: the outline of the body, even if the stream has an isovalue.
  std::optional<double> isovalue = std::nullopt;
  /// The outline of the particles with this value of `phase_attribute` (core/PHASES.md), at most
  /// 2^24 in magnitude. Sections with phases divide the outline of the stream: two phases share the
  /// points of their interface. All other particles are one more phase, without a result. No two
  /// sections have the same phase. Requires Placement::kVirtualPlane; excludes surfaces, slices,
  /// Boundary::kGrains, and isovalues of this section or of the stream.
  std::optional<std::int32_t> phase = std::nullopt;

  friend bool operator==(const Section&, const Section&) = default;
};

/// A periodic axis: a particle at `x` is also at `x` plus any whole number of lengths.
struct PeriodicAxis {
  double origin = 0;  ///< Lower end of the box, world units.
  double length = 0;  ///< World units.

  friend bool operator==(const PeriodicAxis&, const PeriodicAxis&) = default;
};

/// A rectangular box with periodic axes: x, y, z. An absent axis is not periodic and has no ends.
struct PeriodicBox {
  std::array<std::optional<PeriodicAxis>, 3> axes{};

  /// Whether results are wrapped: every outline or surface is cut at the faces, so nothing lies
  /// beyond them. Requires a placement with KeepsGuarantees.
  bool wraps = false;

  static constexpr double kMostSpacings = 1e8;  ///< Largest PeriodicAxis::length, in spacings.

  friend bool operator==(const PeriodicBox&, const PeriodicBox&) = default;
};

/// A fixed wall in the plane of the particles: straight lines between consecutive points, with the
/// fluid on their left. Two points: the endless line through them. More points: a closed polygon, a
/// tank if it is counter-clockwise, an obstacle if it is clockwise.
struct Wall {
  /// x0, y0, x1, y1, ... in world units. Consecutive points differ; a polygon does not touch
  /// itself.
  std::vector<double> points;

  friend bool operator==(const Wall&, const Wall&) = default;
};

/// A fixed wall of a surface: a plane parallel to two axes.
struct WallPlane {
  int axis = 0;         ///< The coordinate that is constant on the wall: 0, 1, 2 for x, y, z.
  double position = 0;  ///< That coordinate, in world units.
  bool is_fluid_above = true;  ///< The fluid has larger coordinates than the wall.

  friend bool operator==(const WallPlane&, const WallPlane&) = default;
};

/// Used only by Output::kSurface.
struct SurfaceOptions {
  /// Vertices on lattice edges are dropped where they are at most this far from the triangles that
  /// replace them, in spacings. At least 0; 0 keeps all. Marching cubes ignore it.
  double thinning_distance = .03;

  /// Bodies of up to this many particles become ellipsoids with the volume and the moments of their
  /// particles, where nothing else is near. 0: none. Only for `virtual-plane`.
  std::uint64_t max_drop_particles = 30;

  /// Removes points while the root mean square error stays below this many spacings. No removed
  /// point is farther than twice this many spacings from the surface. In [0, 1]; 0 keeps all
  /// points. The guarantees S1 to S5 (surface.h) hold: where a removal would break one, triangles
  /// stay as they are. Shells lose some of their volume (core/SURFACES.md, "Simplification").
  /// meshoptimizer allocates memory by its own allocator (meshopt_setAllocator), so frames allocate
  /// memory also with a warm workspace.
  double simplify = 0;

  /// Spray: drops bodies whose particles have less volume than this, in cubed spacings. At least 0;
  /// 0 keeps all. `min_component_particles` applies to surfaces, too.
  double min_component_volume = 0;

  friend bool operator==(const SurfaceOptions&, const SurfaceOptions&) = default;
};

/// The parameters of a stream. Output::kSurface requires `spacing`; it excludes `slice`, `isovalue`
/// and Placement::kFarthestParticle. Surfaces ignore `fill`, `attribute_tolerance`,
/// `normal_memory`, `min_component_area` and `plane`. The sections of a stream with a surface are
/// slices of the same particles; they use these parameters, except `plane`.
struct ReconstructionParameters {
  Output output = Output::kOutline;
  Placement placement = Placement::kVirtualPlane;
  Fill fill = Fill::kGreedy;

  /// Limits of the spacing. Within them, squares and products of lengths neither overflow nor
  /// underflow.
  static constexpr double kMinSpacing = 1e-60, kMaxSpacing = 1e60;

  /// Particle spacing h in world units, in [1e-60, 1e60]. A caller that knows h, such as a
  /// simulator, should give it. Absent: estimated by `spacing_rule`. The lengths below are
  /// multiples of h.
  std::optional<double> spacing = std::nullopt;
  SpacingRule spacing_rule = SpacingRule::kFirstFrame;

  /// With own sizes, a particle acts within `kernel_radius` times h_i, and smoothing follows the
  /// local size. Frames must have volumes. Except with grains, an absent spacing is estimated as
  /// the root mean square of the sizes. A size must be within a factor of `kMostSizeRatio` of the
  /// spacing, and its kernel radius at most 32 cells. Excludes slices, `noise_filter` and
  /// Placement::kFarthestParticle.
  static constexpr double kMostSizeRatio = 10;
  Sizes sizes = Sizes::kEqual;

  /// With grains, outlines follow discs, voids without room for another grain are inside, and a
  /// lone disc is a component (core/SIZES.md, "Grains"). Requires Sizes::kOwn; excludes isovalues
  /// and surfaces. `kernel_radius` and `reference_radius` are ignored, `cell_size` is in half
  /// spacings. An absent spacing is the smallest diameter of the frame, raised if necessary until
  /// the largest diameter is at most `kMostSizeRatio` spacings and `kLargestGrain` cells. A
  /// diameter must be at least `kSmallestGrain` cells, so that no grain falls between the nodes of
  /// the lattice, and at most `kLargestGrain` cells, because kernels reach neighbouring tiles only.
  static constexpr double kSmallestGrain = 1.42, kLargestGrain = 20;
  Boundary boundary = Boundary::kBulk;

  /// Kernel radius R in spacings, in [1.5, 8]. With a larger radius the outline is smoother, and
  /// the cost grows with the square of R; with a smaller radius the outline follows single
  /// particles.
  double kernel_radius = 3.0;

  /// Lattice spacing in spacings, in [0.25, 4]. Smaller cells resolve more detail; the cost grows
  /// with the inverse square.
  double cell_size = 1.0;

  /// Reference radius r of the level set in spacings, in (0, kernel_radius). A larger radius moves
  /// the outline outward by the difference. Absent: calibrated for the placement and kernel radius,
  /// so that a flat boundary lies h/2 outside the outermost layer of particles (core/METHOD.md,
  /// "Calibration").
  std::optional<double> reference_radius = std::nullopt;

  /// `farthest-particle` only: moves vertices outward by this number of spacings, in [-1, 1]. The
  /// paper has 0; 0.5 matches the volume of the particles.
  double surface_offset = 0.0;

  /// Used only by `greedy` for frames with attributes: the largest error of an attribute in the
  /// mesh, as a fraction in [0, 1] of its range over the particles. Below 1, the interior is
  /// covered with blocks instead of rectangles, without T-junctions (core/METHOD.md, "Mesh").
  double attribute_tolerance = 0.01;

  /// Takes, of the two directions of a cell's normal, the one closer to the cell's normal in the
  /// last frame (Eq. 11), which also replaces a weak normal. If false, or in cells without a last
  /// normal, the outline determines the direction. Used only by `farthest-particle` and `qef`, and
  /// only without `box`.
  bool normal_memory = true;

  /// Closes holes below 2 squared spacings (grains: 0.5; surfaces: 2 cubed spacings), with
  /// everything inside them, and drops components without particles. Absent: on for
  /// `virtual-plane` without an isovalue, else off.
  std::optional<bool> clean = std::nullopt;

  /// Spray: drops components that enclose less area than `min_component_area`, in squared spacings
  /// (a lone particle: about 2, grain: .5), or fewer particles than `min_component_particles`, with
  /// everything inside them. FrameStatistics::dropped_spray counts them. At least 0; 0 keeps all.
  double min_component_area = 0;
  std::uint64_t min_component_particles = 0;

  /// The plane in which positions with three components lie; ignored for positions with two.
  Plane plane = Plane::kXy;

  /// If present, particles fill space, and the outline is the section of their body with this plane
  /// (core/METHOD.md, "Slices"). Positions have three components, distances are measured in space,
  /// volumes replace areas (h^3 replaces h^2). Particles farther from the plane than the kernel
  /// radius have no effect. Requires `spacing` and a placement with KeepsGuarantees; `plane` is
  /// ignored.
  std::optional<SlicePlane> slice = std::nullopt;

  static constexpr double kMinIsovalue = 0.01, kMaxIsovalue = 10;

  /// If present, the outline is the isoline of the density at this value, in [0.01, 10], instead of
  /// F = 0 (core/METHOD.md, "Isolines of the density"). The density is the kernel sum over the
  /// particles, weighted by their volumes: about 1 inside a body, 1/2 on a flat boundary. Vertices
  /// lie on the isoline; `reference_radius` is ignored. Requires a placement with KeepsGuarantees.
  std::optional<double> isovalue = std::nullopt;

  static constexpr std::size_t kMaxSections = 16;

  /// Further outlines of each frame (Result::sections), at most 16. Each costs as much as another
  /// frame, except that the input is checked only once. Phases: see core/PHASES.md.
  std::vector<Section> sections = {};

  /// Name, of at most 64 bytes, of the attribute (Frame::attributes) with the phase of each
  /// particle, a whole number such as a type. Used only with Section::phase or `wall_phases`.
  /// Frames must then have the attribute, and it is not interpolated.
  std::string phase_attribute = "phase";

  SurfaceOptions surface = {};

  /// If present, a body that crosses a face of the box is one body (core/PERIODIC.md).
  /// Particles may lie in the box or beside it. Results are unwrapped unless `wraps`: each body is
  /// whole, and the centre of its bounding box lies in the box. A body that reaches its own image
  /// is cut at the faces (Rings::cuts, Surface::cuts). `farthest-particle` refuses such a frame
  /// (PERCOLATES). A length must be at least four kernel radii, in each frame also those of its
  /// largest particle, and at most kMostSpacings spacings. For outlines, only axes of the plane of
  /// the particles may be periodic. Excludes slices. Phases are cut with their body. Frame::box may
  /// replace it.
  std::optional<PeriodicBox> box = std::nullopt;

  /// If present, positions are filtered from frame to frame against white noise (core/NOISE.md).
  /// The value w, in (0, 1], is the weight of a given position: the filtered position is w given +
  /// (1 - w) predicted. The last frame and the motion of the neighbours predict the position of a
  /// particle. 0.5 is a good value; 1 filters nothing. Frames must have ids. A new particle keeps
  /// its given position. Until the stream has a spacing, no position is filtered.
  std::optional<double> noise_filter = std::nullopt;

  static constexpr std::size_t kMaxWallPoints = 1024;

  /// Walls, of at most 1024 points together, at which the outline is cut (core/WALLS.md). The fluid
  /// lies on the fluid side of every wall. An outline nearer than half a local size to a wall runs
  /// along the wall. Obstacles narrower than a cell may be missed. In a box, endless lines are
  /// parallel to the periodic axis, and polygons are obstacles, which have periodic images.
  /// Requires Placement::kVirtualPlane; excludes surfaces, slices, isovalues, grains and
  /// sections that are no phases.
  std::vector<Wall> walls = {};

  static constexpr std::size_t kMaxWallPhases = 16;

  /// The phases (`phase_attribute`) of wall particles, at most 16, distinct, and none of a section.
  /// The outline of these particles is a further wall in each frame, half a size outside of their
  /// outermost layers. Walls need two layers or more. Requires and excludes the same as `walls`;
  /// excludes `noise_filter`, too.
  std::vector<std::int32_t> wall_phases = {};

  static constexpr std::size_t kMaxWallPlanes = 6;

  /// Walls at which a surface is cut (core/WALLS.md, "Surfaces"): for each axis at most one with
  /// the fluid above and one with the fluid below, at least a kernel radius apart. The fluid lies
  /// on the fluid side of every wall. The triangles on walls are in Surface::cuts. No wall is
  /// across a periodic axis of the box. With own sizes, the kernel radius of the largest particle
  /// counts. Requires Output::kSurface; excludes sections.
  std::vector<WallPlane> wall_planes = {};

  friend bool operator==(const ReconstructionParameters&,
                         const ReconstructionParameters&) = default;
};

/// Checks every field. Errors: INVALID_ARGUMENT with the Violation of the first broken rule.
absl::Status Validate(const ReconstructionParameters& parameters);

/// Checks the limits of a box, and that it has a periodic axis. `kernel_radius` is in spacings,
/// `spacing` in world units. With spacing 0 (unknown), a length only has to be positive and at most
/// 1e69. Errors: INVALID_ARGUMENT with the Violation of the first broken rule.
absl::Status Validate(const PeriodicBox& box, double kernel_radius, double spacing);

/// Fills in `reference_radius` and `clean` if they are absent. With grains, replaces
/// `kernel_radius` and `reference_radius`. Requires: Validate(parameters).ok().
ReconstructionParameters Resolve(ReconstructionParameters parameters);

/// Whether results of this placement have all guarantees of result.h: rings are simple and nested,
/// triangles are not folded. False only for `farthest-particle`, which is exempt from R2, R3, R4,
/// M1 and M2 and cannot be combined with a slice or an isovalue.
bool KeepsGuarantees(Placement placement);

/// The names used on command lines, in files and in reports: "marching-squares", "greedy", ...
std::string_view Name(Output output);
std::string_view Name(Placement placement);
std::string_view Name(Fill fill);
std::string_view Name(SpacingRule rule);
std::string_view Name(Sizes sizes);
std::string_view Name(Boundary boundary);
std::string_view Name(Plane plane);
std::span<const Placement> AllPlacements();
std::span<const Fill> AllFills();
std::optional<Placement> FindPlacement(std::string_view name);
std::optional<Fill> FindFill(std::string_view name);

}  // namespace partiemc
