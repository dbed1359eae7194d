// Copies of some particles of a frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/frame.h"

namespace partiemc {

/// The volumes, ids and attributes of chosen particles, and the time of their frame. The names of
/// attributes are views of the frame. The next Take reuses the memory.
class ParticleCopy {
 public:
  /// Copies from `frame` the particles `sources`, in this order. Cost: linear.
  void Take(const Frame& frame, std::span<const std::uint32_t> sources);

  /// Sets the volumes, ids, attributes and the time of a frame to views of this copy.
  void View(Frame& frame) const;

 private:
  double time_ = 0;
  std::vector<float> volumes_;
  std::vector<std::uint64_t> ids_;
  std::vector<std::vector<float>> values_;  // By attribute; buffers are kept.
  std::vector<Attribute> attributes_;
};

}  // namespace partiemc
