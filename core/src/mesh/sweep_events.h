// The events of a sweep: the corners of closed loops in the order in which it meets them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// One passage of a loop through a point.
struct SweepEvent {
  Point point;
  std::uint32_t index, previous, next;  // Of points.
};

/// Keeps its memory warm from one use to the next.
class SweepEvents {
 public:
  /// Lists the corners of the loops in the order of SweepsBefore, those at one place together, that
  /// of the lowest index first. Loops are given as to Triangulator::Triangulate; false, with no
  /// events, if indices, offsets, coordinates or the lengths of loops break its first requirement.
  /// Cost: linear where heights are spread, n log n where many points are about equally high.
  [[nodiscard]] bool Collect(std::span<const double> points,
                             std::span<const std::uint32_t> loop_points,
                             std::span<const std::uint32_t> loop_offsets);

  std::span<const SweepEvent> events() const { return events_; }

 private:
  bool List(std::span<const double> points, std::span<const std::uint32_t> loop_points,
            std::span<const std::uint32_t> loop_offsets);
  void Sort();

  std::vector<SweepEvent> events_, dealt_;
  std::vector<std::uint32_t> ends_;  // Of the buckets.
};

}  // namespace partiemc
