// Sorts the corners of closed loops into the order of a sweep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A point of a loop, which may turn there or not.
struct SweepEvent {
  Point point;
  std::uint32_t index, previous, next;  // Indices of this point and its neighbours on the loop.
};

/// The sorted points of loops. Reuses its memory.
class SweepEvents {
 public:
  /// Lists the points of the loops in the order of SweepsBefore; points at the same position are
  /// ordered by index. Parameters as for Triangulator::Triangulate. Returns false, without events,
  /// if they break requirement 1 of Triangulate. Unlike there, neighbours may have equal positions.
  /// Cost: linear if the values of y are spread evenly, n log n if many of them are similar.
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
