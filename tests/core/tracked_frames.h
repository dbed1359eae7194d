// Frames in space for tests of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "partiemc/partiemc.h"

namespace partiemc::support {

/// Frames in space with ids, velocities and an attribute.
class TrackedFrames {
 public:
  /// `volumes` of each frame, or none. Requires: `frames` outlives this object.
  explicit TrackedFrames(const std::vector<std::vector<double>>& frames,
                         std::vector<std::vector<float>> volumes = {})
      : frames_(frames), volumes_(std::move(volumes)) {
    volumes_.resize(frames.size());
    for (const std::vector<double>& xyz : frames) {
      velocities_.emplace_back(xyz.size(), 1.0f);
      ids_.emplace_back();
      for (std::size_t k = 0; k < xyz.size() / 3; ++k) ids_.back().push_back(k);
    }
    for (const std::vector<float>& velocities : velocities_) {
      attributes_.push_back({"velocity", 3, velocities});
    }
  }

  /// Frame k; with positions and volumes only unless it is tracked.
  Frame At(std::size_t k, bool is_tracked = true) const {
    Frame frame{
        .positions = std::span<const double>(frames_[k]), .components = 3, .volumes = volumes_[k]};
    if (!is_tracked) return frame;
    frame.ids = ids_[k];
    frame.velocities = velocities_[k];
    frame.attributes = std::span(&attributes_[k], 1);
    frame.time = static_cast<double>(k);
    return frame;
  }

 private:
  const std::vector<std::vector<double>>& frames_;
  std::vector<std::vector<float>> volumes_;
  std::vector<std::vector<float>> velocities_;
  std::vector<std::vector<std::uint64_t>> ids_;
  std::vector<Attribute> attributes_;
};

}  // namespace partiemc::support
