// Reserves the memory of a frame.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"
#include "workspace_bytes.h"

namespace partiemc {

/// Reserves memory for the outlines and the surface of a frame, one after another. Each Reserve
/// replaces the one before, until Done.
class FrameMemory final : public MemoryGuard {
 public:
  explicit FrameMemory(MemoryGuard* guard) : guard_(guard) {}

  bool Reserve(std::uint64_t bytes) override {
    last_ = bytes;
    return guard_ == nullptr || guard_->Reserve(done_ + last_);
  }

  /// Returns RESOURCE_EXHAUSTED if the guard refuses the memory of the outlines so far.
  absl::Status ReserveOutline(const FrameSize& size) {
    const std::uint64_t bytes = done_ + WorkspaceBytes(size);
    if (Reserve(WorkspaceBytes(size))) return absl::OkStatus();
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonOutOfMemory), "positions",
         absl::StrCat(size.tiles, " tiles of 32 x 32 cells"),
         absl::StrCat("must fit into the memory budget, but needs ", (bytes >> 20) + 1,
                      " MiB: reach fewer tiles, or try again later")});
  }
  /// Keeps the memory reserved last, in addition to what is reserved later.
  void Done() { done_ += last_; }

  /// Returns RESOURCE_EXHAUSTED if the guard refuses the memory to filter or lift particles.
  absl::Status ReserveParticles(std::uint64_t bytes, const char* which) {
    if (Reserve(bytes)) return absl::OkStatus();
    return ViolationError(absl::StatusCode::kResourceExhausted,
                          {std::string(kReasonOutOfMemory), "positions", which,
                           absl::StrCat("must fit into the memory budget, but need ",
                                        (bytes >> 20) + 1, " MiB: try again later")});
  }

 private:
  MemoryGuard* const guard_;
  std::uint64_t done_ = 0, last_ = 0;
};

}  // namespace partiemc
