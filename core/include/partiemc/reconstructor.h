// The whole method: a frame of particles and a state in, rings, mesh and the next state out.
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

/// Changes whenever the same frames and parameters would give other digests than before.
inline constexpr std::uint32_t kMethodVersion = 10;

/// Buffers that are kept warm from frame to frame. Belongs to a worker, not to a stream: any
/// workspace serves any reconstructor, and its history never changes a result.
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

/// Says how much memory a frame may use.
class MemoryGuard {
 public:
  virtual ~MemoryGuard() = default;

  /// Whether the workspace and the result may grow to `bytes` in all, for one frame. Called by the
  /// thread that called Reconstruct, twice for each outline of a frame, each time before anything
  /// of it is allocated: with what its tiles need at least, then with all that it needs.
  virtual bool Reserve(std::uint64_t bytes) = 0;
};

/// How somebody else follows a frame on its way, and stops it. Each may be left out; all outlive
/// the call.
struct FrameControl {
  StageObserver* observer = nullptr;
  MemoryGuard* memory = nullptr;
  /// Set by any thread, and then left: the frame ends as soon as somebody sees it, which is between
  /// two tiles, rings or particles.
  const std::atomic<bool>* cancelled = nullptr;
};

struct VirtualPlaneVariant;  // core/internal/research.h

/// Knows the order of the stages; holds no state of a stream. Safe to share between threads.
class Reconstructor {
 public:
  /// Errors: INVALID_ARGUMENT, see Validate of either.
  static absl::StatusOr<Reconstructor> Create(const ReconstructionParameters& parameters,
                                              const FrameLimits& limits = {});

  /// Reconstructs one frame. Runs its parallel parts in the Arena of the caller; the result has the
  /// same bits for any number of threads.
  /// Errors: INVALID_ARGUMENT (a coordinate that is not finite, a wrong count, an id twice,
  /// particles outside one plane), RESOURCE_EXHAUSTED (more particles or tiles than the limits
  /// allow in an outline, or more memory than `control.memory` does), OUT_OF_RANGE (float32 too
  /// coarse for the spacing), each with a Violation; CANCELLED, by `control.cancelled`. `state` is
  /// then as it was and `result` is empty. So they are when memory runs out (std::bad_alloc); then,
  /// and after CANCELLED, `workspace` is as good as new. Cost: linear in particles and tiles; n log
  /// n in the points of the rings.
  absl::Status Reconstruct(const Frame& frame, State& state, Workspace& workspace, Result& result,
                           const FrameControl& control = {}) const;

  /// The parameters as resolved.
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
  std::vector<ReconstructionParameters> sections_;  // Resolved.
  FrameLimits limits_;
  std::shared_ptr<const VirtualPlaneVariant> variant_;
};

}  // namespace partiemc
