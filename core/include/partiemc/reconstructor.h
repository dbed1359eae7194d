// Turns frames of particles into outlines and meshes, or into surfaces.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/state.h"

namespace partiemc {

/// Version of the method. Each change that gives other digests for the same frames and parameters
/// increments it.
inline constexpr std::uint32_t kMethodVersion = 11;

/// Reusable buffers, one set for each thread that calls Reconstruct. A workspace can be used with
/// any reconstructor. Earlier frames in the same workspace never change a result.
class Workspace {
 public:
  Workspace();
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

  struct Buffers;
  Buffers& buffers() { return *buffers_; }

 private:
  std::unique_ptr<Buffers> buffers_;
};

/// Decides whether a frame may use the memory that it requires.
class MemoryGuard {
 public:
  virtual ~MemoryGuard() = default;

  /// Returns whether workspace and result may grow to `bytes` in total; if not, Reconstruct returns
  /// RESOURCE_EXHAUSTED. Called on Reconstruct's thread, several times per frame, each time before
  /// this memory is allocated: for filtered or copied particles, if there are any; for each outline
  /// after its particles are sorted, with a lower bound from the number of tiles, and again when
  /// its length is known. For surfaces see SurfaceReconstructor.
  virtual bool Reserve(std::uint64_t bytes) = 0;
};

/// Observes, admits and cancels one frame. Members may be null; their objects outlive the call.
struct FrameControl {
  StageObserver* observer = nullptr;
  MemoryGuard* memory = nullptr;
  /// Any thread may set the flag to cancel the frame. Reconstruct never resets it. Tasks check it
  /// between tiles, rings and particles.
  const std::atomic<bool>* cancelled = nullptr;
};

struct VirtualPlaneVariant;  // core/internal/research.h
class SurfaceReconstructor;  // partiemc/surface_reconstructor.h

/// Reconstructs frames with the parameters of one stream. Immutable; may be shared between threads.
class Reconstructor {
 public:
  /// Errors: INVALID_ARGUMENT, as Validate of the parameters and Validate of the limits.
  static absl::StatusOr<Reconstructor> Create(const ReconstructionParameters& parameters,
                                              const FrameLimits& limits = {});

  /// Reconstructs one frame and updates `state`. Runs its parallel parts in the caller's Arena; the
  /// result does not depend on the number of threads. Cost: linear in particles and tiles, n log n
  /// in the points of the rings.
  /// Errors with a Violation (reasons in proto/PROTOCOL.md):
  ///   INVALID_ARGUMENT: the frame breaks a rule, or the state is of another kind of stream.
  ///   RESOURCE_EXHAUSTED: too many particles or tiles, or `control.memory` refused the memory.
  ///   OUT_OF_RANGE: float32 too coarse for the spacing of an outline; not checked for slices.
  /// Errors without a Violation: CANCELLED, if `control.cancelled` was set; INTERNAL, a bug.
  /// On an error or exception (std::bad_alloc) `state` is unchanged and `result` is empty. After
  /// CANCELLED or an exception `workspace` is empty, too.
  absl::Status Reconstruct(const Frame& frame, State& state, Workspace& workspace, Result& result,
                           const FrameControl& control = {}) const;

  /// The resolved parameters (Resolve).
  const ReconstructionParameters& parameters() const { return parameters_; }

 private:
  friend absl::StatusOr<Reconstructor> CreateVariant(const ReconstructionParameters& parameters,
                                                     const VirtualPlaneVariant& variant,
                                                     const FrameLimits& limits);

  Reconstructor(const ReconstructionParameters& parameters, const FrameLimits& limits,
                const VirtualPlaneVariant& variant);

  absl::Status ReconstructOrThrow(const Frame& frame, State& state, Workspace::Buffers& buffers,
                                  Result& result, const FrameControl& control) const;

  ReconstructionParameters parameters_;
  std::vector<ReconstructionParameters> sections_;  // By section, resolved.
  FrameLimits limits_;
  std::shared_ptr<const VirtualPlaneVariant> variant_;
  std::shared_ptr<const SurfaceReconstructor> surface_;  // Null for Output::kOutline.
  // The parameters for the outline of wall particles; null without wall phases.
  std::shared_ptr<const ReconstructionParameters> walls_;
};

}  // namespace partiemc
