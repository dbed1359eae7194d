// The scatter floor's loops. Compiled once for each instruction set, each into its own namespace
// (PARTIEMC_SCATTER_NAMESPACE).
#ifdef __SSE__
#include <immintrin.h>
#endif

#include <cstring>

#include "bench/scatter_floor.h"

namespace partiemc::bench::PARTIEMC_SCATTER_NAMESPACE {
namespace {

constexpr int kTileShift = 5;
constexpr int kReach = 8;  // Nodes of a row that a particle is scattered to, at least 2R + 1.
#ifdef __AVX__
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif
using Lanes [[gnu::vector_size(kLanes * sizeof(float))]] = float;

// GCC makes two instructions of `v > 0 ? v : 0`.
Lanes Positive(Lanes v) {
#if defined(__AVX__)
  return _mm256_max_ps(v, Lanes{});
#elif defined(__SSE__)
  return _mm_max_ps(v, Lanes{});
#else
  return v > 0 ? v : Lanes{};
#endif
}

void SortByTile(std::span<const float> xy, const LatticeBox& box, ScatterBuffers& b) {
  const std::size_t count = xy.size() / 2;
  const auto tiles_per_row = static_cast<std::uint32_t>((box.columns >> kTileShift) + 1);
  const auto tile_rows = static_cast<std::uint32_t>((box.rows >> kTileShift) + 1);
  b.tile_of.resize(count);
  b.offsets.assign(std::size_t{tiles_per_row} * tile_rows + 1, 0);
  b.sorted.resize(xy.size());
  const auto left = static_cast<float>(box.first_column);
  const auto bottom = static_cast<float>(box.first_row);
  std::uint32_t* const offsets = b.offsets.data();
  for (std::size_t k = 0; k < count; ++k) {
    const auto column = static_cast<std::uint32_t>(static_cast<int>(xy[2 * k] - left));
    const auto row = static_cast<std::uint32_t>(static_cast<int>(xy[2 * k + 1] - bottom));
    const std::uint32_t tile = (row >> kTileShift) * tiles_per_row + (column >> kTileShift);
    b.tile_of[k] = tile;
    ++offsets[tile];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& offset : b.offsets) {
    const std::uint32_t of_tile = offset;
    offset = sum;
    sum += of_tile;
  }
  float* const sorted = b.sorted.data();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t place = 2 * std::size_t{offsets[b.tile_of[k]]++};
    sorted[place] = xy[2 * k] - left;
    sorted[place + 1] = xy[2 * k + 1] - bottom;
  }
}

// A particle reaches at most 2R + 1 nodes of a row, in at most 2R + 1 rows, all within kReach.
template <int kRadius>
void Scatter(ScatterBuffers& b) {
  constexpr int kRows = 2 * kRadius + 1;
  static_assert(kRows <= kReach);
  constexpr int kParts = kReach / kLanes;
  constexpr float kInverse = 1.0f / (kRadius * kRadius);
  Lanes lane[kParts];
  for (int node = 0; node < kReach; ++node) {
    lane[node / kLanes][node % kLanes] = static_cast<float>(node);
  }
  const std::size_t count = b.sorted.size() / 2;
  const std::size_t stride = b.stride;
  const float* const sorted = b.sorted.data();
  float* const density = b.density.data();
  for (std::size_t k = 0; k < count; ++k) {
    const float x = sorted[2 * k] - kRadius, y = sorted[2 * k + 1] - kRadius;
    // Ceilings: the margin keeps both positive.
    const int i = static_cast<int>(x) + 1, j = static_cast<int>(y) + 1;
    const float first_dx = static_cast<float>(i - kRadius) - x;
    Lanes in_row[kParts];
    for (int part = 0; part < kParts; ++part) {
      const Lanes dx = lane[part] + first_dx;
      in_row[part] = 1.0f - dx * dx * kInverse;
    }
    float* row = density + static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i);
    float dy = static_cast<float>(j - kRadius) - y;
#pragma GCC unroll 8
    for (int r = 0; r < kRows; ++r, row += stride, dy += 1) {
      const float out_of_row = dy * dy * kInverse;
      for (int part = 0; part < kParts; ++part) {
        const Lanes t = Positive(in_row[part] - out_of_row);
        Lanes nodes;
        std::memcpy(&nodes, row + part * kLanes, sizeof(nodes));  // Unaligned.
        nodes += t * t * t;
        std::memcpy(row + part * kLanes, &nodes, sizeof(nodes));
      }
    }
  }
}

}  // namespace

void ScatterDensity(std::span<const float> xy, const LatticeBox& box, int kernel_radius,
                    ScatterBuffers& b) {
  SortByTile(xy, box, b);
  // Padding for writes beyond the last node. A power of two would map rows to the same cache sets.
  b.stride = static_cast<std::size_t>(box.columns) + kReach;
  if (b.stride % 64 == 0) b.stride += 16;
  b.density.assign(b.stride * static_cast<std::size_t>(box.rows + 1) + kReach, 0);
  kernel_radius == 2 ? Scatter<2>(b) : Scatter<3>(b);
}

}  // namespace partiemc::bench::PARTIEMC_SCATTER_NAMESPACE
