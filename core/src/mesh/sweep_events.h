// Sorts the corners of closed loops into the order of a sweep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A corner of a loop.
struct SweepEvent {
  Point point;
  std::uint32_t index, previous, next;  // Indices of this point and its neighbours on the loop.
};

/// The sorted corners; keeps its memory warm from one use to the next.
class SweepEvents {
 public:
  /// Lists the corners of the loops in the order of SweepsBefore; corners at the same position are
  /// ordered by index. Parameters as for Triangulator::Triangulate. Returns false, without events,
  /// if the parameters break the first requirement of Triangulate, except that neighbours may have
  /// equal positions.
  /// Cost: linear if heights are spread evenly, n log n if many points have similar heights.
  [[nodiscard]] bool Collect(std::span<const double> points,
                             std::span<const std::uint32_t> loop_points,
                             std::span<const std::uint32_t> loop_offsets);

  std::span<const SweepEvent> events() const { return events_; }

 private:
  bool List(std::span<const double> points, std::span<const std::uint32_t> loop_points,
            std::span<const std::uint32_t> loop_offsets);
  void Sort();

  std::vector<SweepEvent> events_, dealt_;
  std::vector<std::uint32_t> ends_;  // By bucket.
};

}  // namespace partiemc
