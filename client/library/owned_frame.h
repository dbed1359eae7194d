// A frame that owns its arrays.
#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "partiemc/frame.h"

namespace partiemc::client {

/// A copy of a frame. Assigning to it uses its memory again.
class OwnedFrame {
 public:
  OwnedFrame() = default;
  OwnedFrame(OwnedFrame&&) = default;  // Moved vectors keep their elements where they are.
  OwnedFrame& operator=(OwnedFrame&&) = default;

  /// frame().time is `time` from then on, whatever `frame` says.
  void Assign(const Frame& frame, double time, std::uint64_t number) {
    frame_ = frame;
    frame_.time = time;
    number_ = number;
    if (const auto* singles = std::get_if<std::span<const float>>(&frame.positions)) {
      frame_.positions = Copy(*singles, singles_);
    } else {
      frame_.positions = Copy(std::get<std::span<const double>>(frame.positions), doubles_);
    }
    frame_.volumes = Copy(frame.volumes, volumes_);
    frame_.ids = Copy(frame.ids, ids_);
    frame_.velocities = Copy(frame.velocities, velocities_);
  }

  const Frame& frame() const { return frame_; }
  double time() const { return frame_.time; }
  std::uint64_t number() const { return number_; }

 private:
  template <typename T>
  static std::span<const T> Copy(std::span<const T> from, std::vector<T>& to) {
    to.assign(from.begin(), from.end());
    return to;
  }

  std::vector<float> singles_;
  std::vector<double> doubles_;
  std::vector<float> volumes_, velocities_;
  std::vector<std::uint64_t> ids_;
  Frame frame_;  // Of views into the vectors.
  std::uint64_t number_ = 0;
};

}  // namespace partiemc::client
