// Walks over the particles near a box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "space/bins.h"
#include "space/lattice.h"

namespace partiemc::space {

/// A box in cells relative to a brick.
struct NearBox {
  std::array<float, 3> low, high;
};

/// The particles that lie in a row of cells: indices [first, last) of the bins, and the shift to
/// add to their coordinates.
struct NearRun {
  std::uint32_t first, last;
  float shift_x, shift_y, shift_z;
};

/// A block of particles, in cells relative to a brick. Dummies that are too far away to count fill
/// the block up to a multiple of kLanes.
struct NearBlock {
  static constexpr int kCapacity = 512;
  static constexpr int kLanes = 8;
  template <typename Value>
  using PerParticle = std::array<Value, kCapacity + kLanes>;

  static_assert(kLanes <= kBinPadding);

  alignas(64) PerParticle<float> x, y, z;
  alignas(64) PerParticle<float> weight;  ///< 1 if uniform.
  int count = 0;

  /// Adds the particles of a run from `first` on, at most kLanes. Returns their number. Vectors
  /// also copy what follows them in the bins, which counts for nothing.
  std::uint32_t Append(const SpaceBins& bins, const NearRun& run, std::uint32_t first) {
    const auto most = static_cast<std::uint32_t>(std::min(kLanes, kCapacity - count));
    const std::uint32_t added = std::min(run.last - first, most);
    Shift(bins.x.data() + first, run.shift_x, x.data() + count);
    Shift(bins.y.data() + first, run.shift_y, y.data() + count);
    Shift(bins.z.data() + first, run.shift_z, z.data() + count);
    if (bins.weight.empty()) {
      std::fill_n(weight.data() + count, kLanes, 1.0f);
    } else {
      std::copy_n(bins.weight.data() + first, kLanes, weight.data() + count);
    }
    count += static_cast<int>(added);
    return added;
  }

  void Pad() {
    for (int k = count; k % kLanes != 0; ++k) {
      x[k] = y[k] = z[k] = 1e6f;
      weight[k] = 0;
    }
  }

 private:
  static void Shift(const float* from, float by, float* to) {
    for (int k = 0; k < kLanes; ++k) to[k] = from[k] + by;
  }
};

/// Calls visit(NearRun) for runs that contain all particles within `radius` of the box, in the
/// order of the bins: brick by brick, row by row. Runs may also contain other particles.
template <typename Visit>
void ForEachNearRun(const SpaceBins& bins, std::uint32_t brick, const NearBox& box, float radius,
                    Visit visit) {
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
  for (int bz = low[2] >> kBrickShift; bz <= high[2] >> kBrickShift; ++bz) {
    for (int by = low[1] >> kBrickShift; by <= high[1] >> kBrickShift; ++by) {
      for (int bx = low[0] >> kBrickShift; bx <= high[0] >> kBrickShift; ++bx) {
        const std::uint32_t owner = bins.bricks.At(brick, bx, by, bz);
        if (owner == kNoIndex) continue;
        const auto& cells = bins.cells[owner];
        if (cells.front() == cells.back()) continue;
        const int base[3] = {bx * kBrickSize, by * kBrickSize, bz * kBrickSize};
        for (int z = std::max(low[2], base[2]); z <= std::min(high[2], base[2] + 7); ++z) {
          const float dz = distance(z, 2);
          for (int y = std::max(low[1], base[1]); y <= std::min(high[1], base[1] + 7); ++y) {
            const float dy = distance(y, 1);
            const float rest = square - dy * dy - dz * dz;
            if (rest <= 0) continue;
            const float half = std::sqrt(rest);
            // Coordinates are above -64 cells. With 64 added, truncation rounds down.
            const int first =
                std::max(static_cast<int>(box.low[0] - half + 64) - 64, base[0]) - base[0];
            const int last =
                std::min(static_cast<int>(box.high[0] + half + 64) - 64, base[0] + 7) - base[0];
            if (first > last) continue;
            const int row = ((z - base[2]) * kBrickSize + y - base[1]) * kBrickSize;
            const NearRun run{cells[row + first], cells[row + last + 1],
                              static_cast<float>(base[0]), static_cast<float>(base[1]),
                              static_cast<float>(base[2])};
            if (run.first < run.last) visit(run);
          }
        }
      }
    }
  }
}

/// Calls visit(const NearBlock&) for blocks with all particles within `radius` of the box.
template <typename Visit>
void ForEachNearBlock(const SpaceBins& bins, std::uint32_t brick, const NearBox& box, float radius,
                      NearBlock& block, Visit visit) {
  block.count = 0;
  ForEachNearRun(bins, brick, box, radius, [&](const NearRun& run) {
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

}  // namespace partiemc::space
