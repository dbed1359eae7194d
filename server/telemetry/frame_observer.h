// Who is told what became of each frame.
#pragma once

#include <cstdint>
#include <string_view>

namespace partiemc {

class StageClock;

namespace server {

/// Called by the threads that compute, so quick and safe from any of them.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;

  virtual void FrameReconstructed(std::uint64_t particles, const StageClock& clock) = 0;
  /// `reason` is one of those in proto/PROTOCOL.md.
  virtual void FrameRefused(std::string_view reason) = 0;
};

}  // namespace server
}  // namespace partiemc
