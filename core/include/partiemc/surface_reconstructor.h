// Turns frames of particles that fill space into closed surfaces. An interface for research:
// programs use Reconstructor with Output::kSurface, which calls this.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/surface.h"
#include "partiemc/surface_state.h"

namespace partiemc {

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
  Sizes sizes = Sizes::kEqual;
  /// Reference radius of the level set in spacings, as in ReconstructionParameters. Absent: the
  /// value of core/SURFACES.md, "Calibration".
  std::optional<double> reference_radius = std::nullopt;

  /// Fill cavities smaller than 2 h^3 and drop bodies without particles. Absent: on for
  /// `kVirtualPlane`, off for the other placements.
  std::optional<bool> clean = std::nullopt;

  /// As in SurfaceOptions.
  double thinning_distance = .03;
  std::uint64_t max_drop_particles = 30;
  double simplify = 0;
  double min_component_volume = 0;

  /// As ReconstructionParameters::min_component_particles.
  std::uint64_t min_component_particles = 0;

  /// As ReconstructionParameters::box.
  std::optional<PeriodicBox> box = std::nullopt;

  /// As ReconstructionParameters::wall_planes.
  std::vector<WallPlane> wall_planes = {};

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

  /// Reconstructs one frame and updates `state`. Runs in the caller's Arena. The bits of `surface`
  /// and `state` depend neither on the number of threads nor on the order of the particles.
  /// FrameLimits::max_tiles counts bricks of 8 x 8 x 8 nodes, also of copies of bodies that reach
  /// their image in a box. Reserves from `control.memory`, each time in total: copies of particles
  /// (only with a box or walls), then the bricks, then the whole surface.
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
                                  const FrameControl& control) const;

  SurfaceParameters parameters_;
  ReconstructionParameters in_space_;  // Resolved, in the form for the stages.
  FrameLimits limits_;
};

}  // namespace partiemc
