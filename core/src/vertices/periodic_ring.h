// Rings as windows along them are read: straight, with neither end nor beginning.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "crossings/crossings.h"

namespace partiemc {

/// Numbers of a ring's vertices and of those that repeat it beyond each end.
struct PeriodicRingSize {
  std::uint32_t count = 0, margin = 0;
};

/// Lengths along rings and coordinates are whole numbers of this fraction of a cell, modulo 2^32:
/// differences of vertices less than 512 cells apart are exact wherever the ring lies, and what is
/// computed of them in floats is as exact on a long ring as on a short one.
inline constexpr double kRingUnitsPerCell = 1 << 22;

/// Requires: |cells| < 2^41.
inline std::int32_t RingUnits(double cells) {
  return static_cast<std::int32_t>(static_cast<std::int64_t>(cells * kRingUnitsPerCell));
}

/// From one vertex to another, less than 512 cells away.
inline std::int32_t UnitsBetween(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) -
                                   static_cast<std::uint32_t>(from));
}

/// Length of a step, rounded down; MeasureArc (ring_filters.h) adds up such lengths.
inline std::int32_t LengthInUnits(std::int32_t step_x, std::int32_t step_y) {
  const auto x = static_cast<float>(step_x);
  const auto y = static_cast<float>(step_y);
  return static_cast<std::int32_t>(std::sqrt(x * x + y * y));
}

/// Numbers of a closed ring's vertices and of those that a window of `reach` cells holds at most
/// beyond either of its ends, by the very lengths that windows go by: of two vertices that have all
/// but fallen together none may be taken for being beyond it. Cost: the ring's length.
PeriodicRingSize SizeForWindows(std::span<const Point> ring, double reach);

/// One ring. Arrays are by vertex, 0 <= k < count, and go on beyond both ends by `margin` vertices
/// that repeat the ring, so that a window is a contiguous stretch of them.
struct PeriodicRing {
  static constexpr int kUnitArrays = 3, kFloatArrays = 7;

  /// With arrays of which units(k) and floats(k) tell where the first vertex is.
  template <typename Units, typename Floats>
  static PeriodicRing In(const PeriodicRingSize& size, Units units, Floats floats) {
    return {.count = size.count,
            .margin = size.margin,
            .x = units(0),
            .y = units(1),
            .arc = units(2),
            .normal_x = floats(0),
            .normal_y = floats(1),
            .next_x = floats(2),
            .next_y = floats(3),
            .weight = floats(4),
            .base = floats(5),
            .shift = floats(6)};
  }

  std::ptrdiff_t count, margin;
  std::int32_t *x, *y;         ///< Lattice coordinates of the world, in units.
  std::int32_t* arc;           ///< Length of the ring up to the vertex, in units; in margins, too.
  float *normal_x, *normal_y;  ///< Unit, outward.
  float *next_x, *next_y;  ///< Scratch: the normals of the next step; then how supports scatter.
  float* weight;           ///< l: half of the two segments at the vertex, in cells.
  float* base;             ///< Shift along the normal that the vertex's plane asks for, in cells.
  float* shift;            ///< Scratch of the steps; has no margins.

  /// Writes the elements [begin, end) of one of the arrays to where they are repeated. Different
  /// elements are repeated in different places.
  template <typename Value>
  void Repeat(Value* values, std::ptrdiff_t begin, std::ptrdiff_t end) const {
    // A margin may be longer than the ring.
    for (std::ptrdiff_t turn = count; turn + begin < count + margin; turn += count) {
      std::copy(values + begin, values + std::min(end, count + margin - turn),
                values + turn + begin);
    }
    for (std::ptrdiff_t turn = count; end - turn > -margin; turn += count) {
      const std::ptrdiff_t first = std::max(begin, turn - margin);
      std::copy(values + first, values + end, values + first - turn);
    }
  }
};

/// Memory of one ring that is short enough for the stack: it stays in the cache.
class ShortRing {
 public:
  static bool Holds(const PeriodicRingSize& size) {
    return std::size_t{size.count} + 2 * std::size_t{size.margin} <= kRoom;
  }
  /// Requires: Holds(size). Valid as long as this object; elements have no values yet.
  PeriodicRing Of(const PeriodicRingSize& size) {
    return PeriodicRing::In(
        size, [&](int array) { return units_[array] + size.margin; },
        [&](int array) { return floats_[array] + size.margin; });
  }

 private:
  static constexpr std::size_t kRoom = 768;
  std::int32_t units_[PeriodicRing::kUnitArrays][kRoom];
  float floats_[PeriodicRing::kFloatArrays][kRoom];
};

/// Memory of the rings of a frame, kept warm from frame to frame.
class PeriodicRings {
 public:
  using Size = PeriodicRingSize;

  /// Makes room for rings of the given numbers of vertices and margins; 0 vertices for a ring that
  /// has none here. Elements keep no values.
  std::vector<Size>& sizes() { return sizes_; }
  void Allocate();

  /// Requires: Allocate was called after `sizes` were set.
  PeriodicRing operator[](std::size_t ring);

 private:
  std::vector<Size> sizes_;
  std::vector<std::size_t> starts_;
  std::vector<std::int32_t> units_[PeriodicRing::kUnitArrays];
  std::vector<float> floats_[PeriodicRing::kFloatArrays];
};

}  // namespace partiemc
