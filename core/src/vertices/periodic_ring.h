// Rings as arrays that repeat beyond both ends, so that each window along a ring is contiguous.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "crossings/crossings.h"

namespace partiemc {

/// The number of vertices of a ring, and of repeated vertices beyond each end.
struct PeriodicRingSize {
  std::uint32_t count = 0, margin = 0;
};

/// Coordinates and arc lengths are integers in units of 2^-22 cells, modulo 2^32 units, which are
/// 1,024 cells. Differences of less than 512 cells are therefore exact (UnitsBetween). This holds
/// for rings of any length, at any distance from the origin.
inline constexpr double kRingUnitsPerCell = 1 << 22;

/// Converts cells to units, rounded towards 0. Requires: |cells| < 2^41.
inline std::int32_t RingUnits(double cells) {
  return static_cast<std::int32_t>(static_cast<std::int64_t>(cells * kRingUnitsPerCell));
}

/// Returns `to` - `from` in units. Requires: the true difference is less than 512 cells.
inline std::int32_t UnitsBetween(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) -
                                   static_cast<std::uint32_t>(from));
}

/// Length of a step in units, by floats, rounded down. MeasureArc (ring_filters.h) sums the same
/// lengths.
inline std::int32_t LengthInUnits(std::int32_t step_x, std::int32_t step_y) {
  const auto x = static_cast<float>(step_x);
  const auto y = static_cast<float>(step_y);
  return static_cast<std::int32_t>(std::sqrt(x * x + y * y));
}

/// `length` between two vertices, in units, divided by the mean of their local particle sizes, in
/// spacings. Requires: sizes are at least 1/16.
inline std::int32_t LengthInSizes(std::int32_t length, float from_size, float to_size) {
  return static_cast<std::int32_t>(static_cast<float>(length) * (2 / (from_size + to_size)));
}

/// The size of a closed ring, with the margin that windows of `reach` cells need. `sizes`: by
/// vertex, the local size, by which lengths are divided; empty if all are 1. Sums LengthInUnits, as
/// the windows do: by exact lengths, the margin could be too short for nearly coincident vertices.
/// Requires: at least one vertex. Cost: linear in the vertices.
PeriodicRingSize SizeForWindows(std::span<const Point> ring, std::span<const float> sizes,
                                double reach);

/// One ring, in the memory of a ShortRing or PeriodicRings. Arrays are indexed by vertex,
/// 0 <= k < count, and have `margin` more elements beyond each end, which repeat the ring.
struct PeriodicRing {
  static constexpr int kUnitArrays = 3, kFloatArrays = 7;

  /// Makes a ring. units(k) and floats(k) return where the first vertex is in the k-th array.
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
  std::int32_t *x, *y;         ///< Position relative to the origin of the world, in units.
  std::int32_t* arc;           ///< Arc length up to the vertex, in units; divided by the local size
                               ///< if sizes differ. Does not repeat in the margins, but continues.
  float *normal_x, *normal_y;  ///< Unit, outward.
  float *next_x, *next_y;      ///< Scratch: next normals; later next_x: variances of supports.
  float* weight;  ///< l: half the arc length of the two segments at the vertex, in cells; divided
                  ///< by the local size if sizes differ.
  float* base;    ///< Shift of the vertex's plane along the normal, in cells.
  float* shift;   ///< Scratch of the steps; margins are not set.

  /// Copies the elements [begin, end) of an array to the margins. Calls with disjoint ranges may
  /// run in parallel.
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

/// The arrays of one short ring: small enough for the stack, so that they stay in the cache.
class ShortRing {
 public:
  static bool Holds(const PeriodicRingSize& size) {
    return std::size_t{size.count} + 2 * std::size_t{size.margin} <= kCapacity;
  }
  /// A ring in this memory, with uninitialised elements; valid as long as this object.
  /// Requires: Holds(size).
  PeriodicRing Of(const PeriodicRingSize& size) {
    return PeriodicRing::In(
        size, [&](int array) { return units_[array] + size.margin; },
        [&](int array) { return floats_[array] + size.margin; });
  }

 private:
  static constexpr std::size_t kCapacity = 768;
  std::int32_t units_[PeriodicRing::kUnitArrays][kCapacity];
  float floats_[PeriodicRing::kFloatArrays][kCapacity];
};

/// The arrays of any number of rings of any size. Keeps its memory, so a later frame allocates only
/// if its rings need more. ShortRing is faster for a ring that it holds.
class PeriodicRings {
 public:
  using Size = PeriodicRingSize;

  /// The size of each ring, to be set before Allocate; 0 vertices for a ring that needs no arrays.
  std::vector<Size>& sizes() { return sizes_; }
  /// Allocates the arrays. Elements are not initialised, and earlier rings become invalid.
  void Allocate();

  /// The ring with sizes()[ring]. Requires: Allocate was called after the sizes were set.
  PeriodicRing operator[](std::size_t ring);

 private:
  std::vector<Size> sizes_;
  std::vector<std::size_t> starts_;
  std::vector<std::int32_t> units_[PeriodicRing::kUnitArrays];
  std::vector<float> floats_[PeriodicRing::kFloatArrays];
};

}  // namespace partiemc
