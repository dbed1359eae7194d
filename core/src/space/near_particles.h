// Finds the particles near a box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "space/bins.h"
#include "space/lattice.h"

namespace partiemc::space {

/// A box in cells relative to a brick.
struct NearBox {
  std::array<float, 3> low, high;
};

/// Particles [first, last) of the bins, which lie in a row of cells. The shift added to their
/// coordinates makes them relative to the brick of the box.
struct NearRun {
  std::uint32_t first, last;
  float shift_x, shift_y, shift_z;
};

/// A block of particles, in cells relative to a brick. Pad adds dummies up to a multiple of kLanes;
/// they are too far away to count.
struct NearBlock {
  static constexpr int kCapacity = 1024;
  static constexpr int kLanes = 8;
  template <typename Value>
  using PerParticle = std::array<Value, kCapacity + kLanes>;

  static_assert(kLanes <= kBinPadding);

  alignas(64) PerParticle<float> x, y, z;
  alignas(64) PerParticle<float> weight;    ///< With own sizes the size. Unset if uniform.
  alignas(64) PerParticle<float> per_size;  ///< 1 / size; unset without own sizes.
  int count = 0;                            ///< Without dummies.
  bool has_sizes = false;
  bool has_weights = true;  ///< Ignored with own sizes.

  /// Adds the particles of a run from `first` on: at most kLanes, and only those that fit. Returns
  /// the number of added particles. Always copies kLanes values; the next Append or Pad overwrites
  /// the values beyond `count`.
  std::uint32_t Append(const SpaceBins& bins, const NearRun& run, std::uint32_t first) {
    const auto most = static_cast<std::uint32_t>(std::min(kLanes, kCapacity - count));
    const std::uint32_t added = std::min(run.last - first, most);
    Shift(bins.x.data() + first, run.shift_x, x.data() + count);
    Shift(bins.y.data() + first, run.shift_y, y.data() + count);
    Shift(bins.z.data() + first, run.shift_z, z.data() + count);
    if (!bins.size.empty()) {
      std::copy_n(bins.size.data() + first, kLanes, weight.data() + count);
      for (int k = count; k < count + kLanes; ++k) per_size[k] = 1 / weight[k];
    } else if (has_weights) {
      std::copy_n(bins.weight.data() + first, kLanes, weight.data() + count);
    }
    count += static_cast<int>(added);
    return added;
  }

  void Pad() {
    for (int k = count; k % kLanes != 0; ++k) {
      x[k] = y[k] = z[k] = 1e6f;
      weight[k] = 0;
      per_size[k] = 1;
    }
  }

 private:
  static void Shift(const float* from, float by, float* to) {
    // The local array cannot overlap, so that the compiler uses vectors.
    std::array<float, kLanes> shifted;
    for (int k = 0; k < kLanes; ++k) shifted[k] = from[k] + by;
    std::copy_n(shifted.data(), kLanes, to);
  }
};

/// Calls visit(NearRun) for runs that contain all particles of a size class within `radius` of the
/// box, in the order of the bins: brick by brick, row by row. Runs may also contain other particles
/// of the class. `box` and `radius` are in cells of the class, which are 2^shift lattice cells
/// wide. The shifts of the runs are in lattice cells. `kHasCoarseCells` may be false if the shift
/// of the class is 0.
template <bool kHasCoarseCells, typename Visit>
void ForEachNearRunOf(const SpaceBins& bins, std::size_t of_class, std::uint32_t brick,
                      const NearBox& box, float radius, Visit visit) {
  const int brick_shift =
      kHasCoarseCells ? kBrickShift - bins.classes[of_class].shift : kBrickShift;
  const int side = 1 << brick_shift;
  std::array<int, 3> low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = static_cast<int>(std::floor(box.low[axis] - radius));
    high[axis] = static_cast<int>(std::floor(box.high[axis] + radius));
  }
  // The distance of the cells [at, at + 1] from the box along an axis.
  const auto distance = [&](int at, int axis) {
    return std::max({0.0f, static_cast<float>(at) - box.high[axis],
                     box.low[axis] - static_cast<float>(at + 1)});
  };
  const float square = radius * radius;
  for (int bz = low[2] >> brick_shift; bz <= high[2] >> brick_shift; ++bz) {
    for (int by = low[1] >> brick_shift; by <= high[1] >> brick_shift; ++by) {
      for (int bx = low[0] >> brick_shift; bx <= high[0] >> brick_shift; ++bx) {
        const std::uint32_t owner = bins.bricks.At(brick, bx, by, bz);
        if (owner == kNoIndex) continue;
        const auto& cells = bins.cells[owner * bins.classes.size() + of_class];
        if (cells.front() == cells.back()) continue;
        const int base[3] = {bx * side, by * side, bz * side};
        const int last_z = std::min(high[2], base[2] + side - 1);
        const int last_y = std::min(high[1], base[1] + side - 1);
        for (int z = std::max(low[2], base[2]); z <= last_z; ++z) {
          const float dz = distance(z, 2);
          for (int y = std::max(low[1], base[1]); y <= last_y; ++y) {
            const float dy = distance(y, 1);
            const float rest = square - dy * dy - dz * dz;
            if (rest <= 0) continue;
            const float half = std::sqrt(rest);
            // Coordinates are above -64 cells. With 64 added, truncation rounds down.
            const int first =
                std::max(static_cast<int>(box.low[0] - half + 64) - 64, base[0]) - base[0];
            const int last =
                std::min(static_cast<int>(box.high[0] + half + 64) - 64, base[0] + side - 1) -
                base[0];
            if (first > last) continue;
            const int row = ((z - base[2]) * side + y - base[1]) * side;
            const NearRun run{
                cells[row + first], cells[row + last + 1], static_cast<float>(bx * kBrickSize),
                static_cast<float>(by * kBrickSize), static_cast<float>(bz * kBrickSize)};
            if (run.first < run.last) visit(run);
          }
        }
      }
    }
  }
}

/// The rows of cells within a radius of a cube whose corners are nodes. Finds the same runs as
/// ForEachNearRunOf without square roots. For bins with equal sizes.
class NearRows {
 public:
  /// `side`: of the cube, in cells.
  NearRows(int side, float radius) : side_(side), low_(static_cast<int>(std::floor(-radius))) {
    count_ = static_cast<int>(std::floor(static_cast<float>(side) + radius)) - low_ + 1;
    is_exact_ = count_ <= kMost && IsExact(radius);
    const float square = radius * radius;
    for (int z = 0; is_exact_ && z < count_; ++z) {
      for (int y = 0; y < count_; ++y) {
        const float dy = DistanceOf(y), dz = DistanceOf(z);
        const float rest = square - dy * dy - dz * dz;
        Row& row = rows_[z][y] = {0, -1};
        if (rest <= 0) continue;
        const float half = std::sqrt(rest);
        is_exact_ = is_exact_ && IsExact(half);
        row = {static_cast<std::int8_t>(std::floor(-half)),
               static_cast<std::int8_t>(std::floor(static_cast<float>(side) + half))};
      }
    }
  }

  int side() const { return side_; }
  /// Whether ForEachRun may be called. False if there are too many rows, or if rounding, which
  /// differs from place to place, could decide whether a row reaches a cell.
  bool is_exact() const { return is_exact_; }

  /// Calls visit(NearRun) for the rows near the cube with its lowest corner at node `at` of a
  /// brick. Requires: the rows are exact.
  template <typename Visit>
  void ForEachRun(const SpaceBins& bins, std::uint32_t brick, const std::array<int, 3>& at,
                  Visit visit) const {
    std::array<int, 3> low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = at[axis] + low_;
      high[axis] = low[axis] + count_ - 1;
    }
    constexpr int kSide = kBrickSize;
    for (int bz = low[2] >> kBrickShift; bz <= high[2] >> kBrickShift; ++bz) {
      for (int by = low[1] >> kBrickShift; by <= high[1] >> kBrickShift; ++by) {
        for (int bx = low[0] >> kBrickShift; bx <= high[0] >> kBrickShift; ++bx) {
          const std::uint32_t owner = bins.bricks.At(brick, bx, by, bz);
          if (owner == kNoIndex) continue;
          const auto& cells = bins.cells[owner];
          if (cells.front() == cells.back()) continue;
          NearRun run{0, 0, static_cast<float>(kSide * bx), static_cast<float>(kSide * by),
                      static_cast<float>(kSide * bz)};
          const int x = at[0] - kSide * bx;  // Relative to the owner.
          const int last_z = std::min(high[2] - kSide * bz, kSide - 1);
          const int last_y = std::min(high[1] - kSide * by, kSide - 1);
          for (int z = std::max(low[2] - kSide * bz, 0); z <= last_z; ++z) {
            const auto& rows = rows_[z + kSide * bz - low[2]];
            for (int y = std::max(low[1] - kSide * by, 0); y <= last_y; ++y) {
              const Row& row = rows[y + kSide * by - low[1]];
              const int first = std::max(x + row.first, 0);
              const int last = std::min(x + row.last, kSide - 1);
              if (first > last) continue;
              const int cell = (z * kSide + y) * kSide;
              run.first = cells[cell + first];
              run.last = cells[cell + last + 1];
              if (run.first < run.last) visit(run);
            }
          }
        }
      }
    }
  }

 private:
  static constexpr int kMost = 16;

  /// Cells [first, last] relative to the lowest corner.
  struct Row {
    std::int8_t first, last;
  };

  /// Whether a length in cells is an integer, or farther from one than the rounding errors of
  /// ForEachNearRunOf.
  static bool IsExact(float length) {
    const float rest = std::abs(length - std::round(length));
    return rest == 0 || rest > 1e-4f;
  }
  /// The distance of a row of cells from the cube along an axis.
  float DistanceOf(int row) const {
    const int at = low_ + row;
    return static_cast<float>(std::max({0, at - side_, -(at + 1)}));
  }

  int side_, low_, count_;
  bool is_exact_;
  std::array<std::array<Row, kMost>, kMost> rows_;
};

/// Calls visit(NearRun) for runs that contain all particles within `radius`, times their own sizes,
/// of the box, class by class, in the order of the bins. Runs may also contain other particles.
template <typename Visit>
void ForEachNearRun(const SpaceBins& bins, std::uint32_t brick, const NearBox& box, float radius,
                    Visit visit) {
  if (bins.size.empty()) return ForEachNearRunOf<false>(bins, 0, brick, box, radius, visit);
  for (std::size_t k = 0; k < bins.classes.size(); ++k) {
    const SizeClass& of = bins.classes[k];
    const float reach = radius * of.most;
    if (of.shift == 0) {
      ForEachNearRunOf<false>(bins, k, brick, box, reach, visit);
      continue;
    }
    const float unit = 1.0f / static_cast<float>(1 << of.shift);
    NearBox scaled = box;
    for (int axis = 0; axis < 3; ++axis) {
      scaled.low[axis] *= unit;
      scaled.high[axis] *= unit;
    }
    ForEachNearRunOf<true>(bins, k, brick, scaled, reach * unit, visit);
  }
}

/// The particles near a box, from which SelectReaching selects. For bins with own sizes.
template <int kMost>
struct NearRegionOf {
  static constexpr int kCapacity = kMost;
  using PerParticle = std::array<float, kCapacity + NearBlock::kLanes>;

  alignas(64) PerParticle x, y, z, size;
  int count = 0;

  /// Collects the particles within `radius`, times their own sizes, of the box, and some others.
  /// Returns false if not all of them fit.
  bool Collect(const SpaceBins& bins, std::uint32_t brick, const NearBox& box, float radius);
};

using NearBrick = NearRegionOf<8192>;  ///< For a brick.
using NearPart = NearRegionOf<4096>;   ///< For a part of a brick.

/// Sets `part` or `block` to the particles of `region` whose kernels reach the box. `radius`:
/// the kernel radius of size 1. Returns false if not all of them fit.
bool SelectReaching(const NearBrick& region, const NearBox& box, float radius, NearPart& part);
bool SelectReaching(const NearPart& region, const NearBox& box, float radius, NearBlock& block);

/// Calls visit(const NearBlock&) for blocks with all particles of the runs that for_each_run(visit)
/// visits. `block` is a buffer.
template <typename ForEachRun, typename Visit>
void ForEachBlockOf(const SpaceBins& bins, ForEachRun for_each_run, NearBlock& block, Visit visit) {
  block.count = 0;
  block.has_sizes = !bins.size.empty();
  block.has_weights = !bins.weight.empty();
  for_each_run([&](const NearRun& run) {
    for (std::uint32_t p = run.first; p < run.last;) {
      if (block.count == NearBlock::kCapacity) {
        visit(block);
        block.count = 0;
      }
      p += block.Append(bins, run, p);
    }
  });
  if (block.count == 0) return;
  block.Pad();
  visit(block);
}

/// Calls visit(const NearBlock&) for blocks with all particles within `radius`, times their own
/// sizes, of the box.
template <typename Visit>
void ForEachNearBlock(const SpaceBins& bins, std::uint32_t brick, const NearBox& box, float radius,
                      NearBlock& block, Visit visit) {
  const auto for_each_run = [&](auto visit_run) {
    ForEachNearRun(bins, brick, box, radius, visit_run);
  };
  ForEachBlockOf(bins, for_each_run, block, visit);
}

template <int kMost>
bool NearRegionOf<kMost>::Collect(const SpaceBins& bins, std::uint32_t brick, const NearBox& box,
                                  float radius) {
  count = 0;
  bool fits = true;
  ForEachNearRun(bins, brick, box, radius, [&](const NearRun& run) {
    const auto added = static_cast<int>(run.last - run.first);
    fits = fits && added <= kCapacity - count;
    if (!fits) return;
    for (int k = 0; k < added; ++k) {
      const std::uint32_t p = run.first + static_cast<std::uint32_t>(k);
      x[count + k] = bins.x[p] + run.shift_x;
      y[count + k] = bins.y[p] + run.shift_y;
      z[count + k] = bins.z[p] + run.shift_z;
      size[count + k] = bins.size[p];
    }
    count += added;
  });
  return fits;
}

}  // namespace partiemc::space
