// The whole method: a frame of particles and a state in, rings, mesh and the next state out.
#pragma once

#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/state.h"

namespace partiemc {

/// Changes whenever the same frames and parameters would give other digests than before.
inline constexpr std::uint32_t kMethodVersion = 6;

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

/// Knows the order of the seven stages; holds no state of a stream. Safe to share between threads.
class Reconstructor {
 public:
  /// Errors: INVALID_ARGUMENT, see Validate of either.
  static absl::StatusOr<Reconstructor> Create(const ReconstructionParameters& parameters,
                                              const FrameLimits& limits = {});

  /// Reconstructs one frame. Runs its parallel parts in the Arena of the caller; the result has the
  /// same bits for any number of threads.
  /// Errors: INVALID_ARGUMENT (a coordinate that is not finite, a wrong count, an id twice,
  /// particles outside one plane), RESOURCE_EXHAUSTED (more particles or tiles than the limits
  /// allow), each with a Violation; `state` is then as it was and `result` is empty. Cost: linear
  /// in particles and tiles; n log n in the points of the rings.
  absl::Status Reconstruct(const Frame& frame, State& state, Workspace& workspace, Result& result,
                           StageObserver* observer = nullptr) const;

  /// The parameters as resolved.
  const ReconstructionParameters& parameters() const { return parameters_; }

 private:
  Reconstructor(const ReconstructionParameters& parameters, const FrameLimits& limits)
      : parameters_(parameters), limits_(limits) {}

  ReconstructionParameters parameters_;
  FrameLimits limits_;
};

}  // namespace partiemc
