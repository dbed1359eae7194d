// Receives the outcome of each frame.
#pragma once

#include <cstdint>
#include <string_view>

namespace partiemc {

class StageClock;

namespace server {

/// Compute threads call it, so implementations must be fast and thread-safe.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;

  virtual void FrameReconstructed(std::uint64_t particles, const StageClock& clock) = 0;
  /// `reason` is listed in proto/PROTOCOL.md.
  virtual void FrameRefused(std::string_view reason) = 0;
};

}  // namespace server
}  // namespace partiemc
