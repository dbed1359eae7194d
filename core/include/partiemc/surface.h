// Turns frames of particles that fill space into closed surfaces, and checks their guarantees.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/surface_state.h"

namespace partiemc {

struct ShellMeasures {
  double area = 0;    ///< World units squared.
  double volume = 0;  ///< Enclosed, world units cubed; negative for a cavity.
  double centroid_x = 0, centroid_y = 0, centroid_z = 0;  ///< Centroid of the enclosed volume.
  std::uint64_t particles = 0;  ///< Particles of the body; 0 for a cavity.
  /// The shell that continues this shell in the next frame has the same identity. Distinct within a
  /// frame, never reused in a stream (core/SURFACES.md, "Identities").
  std::uint64_t identity = 0;  ///< 0: not tracked.

  friend bool operator==(const ShellMeasures&, const ShellMeasures&) = default;
};

struct SurfaceStatistics {
  std::uint64_t dropped_cavities = 0;    ///< Cavities that cleaning filled.
  std::uint64_t dropped_components = 0;  ///< Bodies without a particle that cleaning removed.
  std::uint64_t dropped_spray = 0;       ///< Bodies below the minimum size in the parameters.

  friend bool operator==(const SurfaceStatistics&, const SurfaceStatistics&) = default;
};

/// Closed surfaces. A shell is one connected surface: the outside of a body, or a cavity in one.
/// Guarantees (core/SURFACES.md):
///   S1 every edge has exactly two triangles, which run along it in opposite directions;
///   S2 the triangles around each point form one cycle; each point has triangles of one shell;
///   S3 triangles intersect only in their common points and edges; none is degenerate;
///   S4 triangles are counter-clockwise seen from outside the body; shells alternate: the next
///      shell around an outer shell, if any, is a cavity, and the next shell around a cavity is the
///      outer shell that `outer_of` gives;
///   S5 offsets, normals and measures fit the triangles: normals have length 1, areas, volumes and
///      centroids are those of the triangles.
struct Surface {
  std::vector<double> points;            ///< x0, y0, z0, x1, ... in world units, by shell.
  std::vector<std::uint32_t> triangles;  ///< Three point indices each, by shell.
  std::vector<float> normals;            ///< Per point: outward unit normal, interleaved.
  std::vector<std::uint32_t> point_offsets = {0};     ///< Shell k: [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> triangle_offsets = {0};  ///< The same for triangles.
  std::vector<std::uint32_t> outer_of;                ///< Per shell: its outer shell, or kNoShell.
  std::vector<ShellMeasures> measures;                ///< Per shell.
  /// Parents of shell k, [parent_offsets[k], parent_offsets[k + 1]): the identities, ascending, of
  /// the shells of the last frame that shell k continues. A new shell has no parent, a body after a
  /// merge has several. After a split, several bodies have the same parent.
  std::vector<std::uint64_t> parents;
  std::vector<std::uint32_t> parent_offsets = {0};  ///< {0} without identities.
  /// The attributes of the frame at the points, in the order of Frame::attributes: `components`
  /// values per point.
  std::vector<AttributeValues> attributes;
  SurfaceStatistics statistics;

  std::size_t ShellCount() const { return outer_of.size(); }
  std::size_t PointCount() const { return points.size() / 3; }
  std::size_t TriangleCount() const { return triangles.size() / 3; }
  std::span<const std::uint64_t> ParentsOf(std::size_t shell) const {
    if (shell + 1 >= parent_offsets.size()) return {};
    return std::span(parents).subspan(parent_offsets[shell],
                                      parent_offsets[shell + 1] - parent_offsets[shell]);
  }
  /// Empties everything. The elements of `attributes` remain, without contents.
  void Clear();
  friend bool operator==(const Surface&, const Surface&) = default;
};

/// Checks S1 to S5 with exact arithmetic, independent of the construction. Measures are compared
/// to 1e-6 of the shell's size. Errors: INTERNAL with the guarantee, the triangle or shell, and the
/// values. Cost: n log n in the triangles if they are of similar size.
absl::Status Validate(const Surface& surface);

/// How the vertices of a surface are placed (core/SURFACES.md).
enum class SurfacePlacement : std::uint8_t {
  kMarchingCubes,  ///< Linear interpolation of the level set on lattice edges.
  kQef,            ///< Vertices in cells by dual contouring (least squares), for comparison.
  kVirtualPlane,   ///< Vertices on smoothed planes, with the volume of the particles.
};

struct SurfaceParameters {
  SurfacePlacement placement = SurfacePlacement::kMarchingCubes;

  /// Particle spacing h in world units, in [1e-60, 1e60]. The lengths below are multiples of h.
  double spacing = 1;
  /// As in ReconstructionParameters, with the same ranges.
  double kernel_radius = 3, cell_size = 1;
  /// Reference radius in spacings. Absent: calibrated (core/SURFACES.md).
  std::optional<double> reference_radius = std::nullopt;

  /// Fill cavities smaller than 2 h^3 and drop bodies without particles. Absent: on for
  /// `kVirtualPlane`, off for the other placements.
  std::optional<bool> clean = std::nullopt;

  /// Vertices on lattice edges are dropped where they are at most this far from the triangles that
  /// replace them. At least 0; 0 keeps all. Not for `kMarchingCubes`.
  double thinning_distance = .03;

  /// Bodies of up to this many particles become ellipsoids with the volume and the moments of their
  /// particles, where nothing else is near. 0: none. Only for `kVirtualPlane`.
  std::uint64_t max_drop_particles = 30;

  /// Removes points while the root mean square error stays below this many spacings. No removed
  /// point is farther than twice this from the surface. In [0, 1]; 0 keeps all points. S1 to S5
  /// hold: where they would not, triangles stay as they are. Shells lose some of their volume
  /// (core/SURFACES.md, "Simplification"). meshoptimizer allocates memory by its own allocator
  /// (meshopt_setAllocator), so frames allocate memory also with a warm workspace.
  double simplify = 0;

  /// Spray: drops bodies whose particles have less volume than `min_component_volume`, in cubed
  /// spacings, or number fewer than `min_component_particles`. At least 0; 0 keeps all.
  double min_component_volume = 0;
  std::uint64_t min_component_particles = 0;

  friend bool operator==(const SurfaceParameters&, const SurfaceParameters&) = default;
};

/// Reusable buffers, one set for each thread that calls Reconstruct. Earlier frames in the same
/// workspace never change a result.
class SurfaceWorkspace {
 public:
  SurfaceWorkspace();
  ~SurfaceWorkspace();
  SurfaceWorkspace(SurfaceWorkspace&&) noexcept;
  SurfaceWorkspace& operator=(SurfaceWorkspace&&) noexcept;

  struct Buffers;
  Buffers& buffers() { return *buffers_; }

 private:
  std::unique_ptr<Buffers> buffers_;
};

/// Reconstructs surfaces. Immutable; may be shared between threads.
class SurfaceReconstructor {
 public:
  /// Errors: INVALID_ARGUMENT with the Violation of the first broken rule.
  static absl::StatusOr<SurfaceReconstructor> Create(const SurfaceParameters& parameters,
                                                     const FrameLimits& limits = {});

  /// Reconstructs one frame and updates `state`; `frame.components` is 3, volumes are in world
  /// units cubed. Runs in the caller's Arena. The bits of `surface` and `state` depend neither on
  /// the number of threads nor on the order of the particles. Limits: `max_tiles` counts bricks of
  /// 8 x 8 x 8 nodes. Reserves from
  /// `control.memory` twice: the bricks, then the full estimate.
  /// No stage is reported to `control.observer`.
  /// Errors: as Reconstructor; INVALID_ARGUMENT (CORRUPT_STATE) for the state of a stream with
  /// another cell size. On an error or exception (std::bad_alloc) `state` is unchanged and
  /// `surface` is empty. After CANCELLED or an exception `workspace` is empty, too.
  absl::Status Reconstruct(const Frame& frame, SurfaceState& state, SurfaceWorkspace& workspace,
                           Surface& surface, const FrameControl& control = {}) const;

  /// Reconstructs a frame that belongs to no stream. Shells have no identities and no parents; all
  /// else is the same.
  absl::Status Reconstruct(const Frame& frame, SurfaceWorkspace& workspace, Surface& surface,
                           const FrameControl& control = {}) const;

 private:
  SurfaceReconstructor(const SurfaceParameters& parameters, const FrameLimits& limits);

  // `state` is null for a frame that belongs to no stream.
  absl::Status ReconstructFrame(const Frame& frame, SurfaceState* state,
                                SurfaceWorkspace& workspace, Surface& surface,
                                const FrameControl& control) const;
  absl::Status ReconstructOrThrow(const Frame& frame, const SurfaceState* state,
                                  SurfaceWorkspace::Buffers& buffers, Surface& surface,
                                  MemoryGuard* memory) const;

  SurfaceParameters parameters_;
  ReconstructionParameters in_space_;  // Resolved, in the form for the stages.
  FrameLimits limits_;
};

}  // namespace partiemc
