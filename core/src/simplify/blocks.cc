#include "simplify/blocks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#define MESHOPTIMIZER_NO_WRAPPERS
#include <meshoptimizer.h>

#include "base/parallel.h"
#include "base/vec3.h"
#include "simplify/mesh_faults.h"

namespace partiemc::simplify {
namespace {

// Side of a block, as a multiple of the error. meshoptimizer sums squared errors as floats in units
// of the side. In larger blocks these floats are too coarse: with 8,000 instead of 1,000, three
// times as many triangles remained.
constexpr double kBlock = 1000;

// Largest error, in extents of the block. A larger one has the same effect.
constexpr double kMostError = 1e30;

double ExtentOf(const Box& box) {
  const Vec3 size = box.high - box.low;
  return std::max({size.x, size.y, size.z});
}

/// Whether meshoptimizer 0.18 would compare too many points with each other. It searches its hash
/// table of positions linearly, and a hostile surface can have many positions with one hash. Usual
/// surfaces have up to 9 pairs per point.
bool HasManyCollisions(std::span<const float> positions) {
  constexpr std::uint64_t kMostPairs = 256;
  const std::size_t points = positions.size() / 3;
  const std::size_t buckets = std::bit_ceil(points + points / 4);
  std::vector<std::uint32_t> in_bucket(buckets, 0);
  std::uint64_t pairs = 0;
  for (std::size_t k = 0; k < points; ++k) {
    const auto part = [&](std::size_t axis) {
      const auto bits = std::bit_cast<std::uint32_t>(positions[3 * k + axis]);
      return bits ^ bits >> 17;
    };
    const std::uint32_t hash = part(0) * 73856093 ^ part(1) * 19349663 ^ part(2) * 83492791;
    pairs += 2 * std::uint64_t{in_bucket[hash & (buckets - 1)]++} + 1;
  }
  return pairs > kMostPairs * points;
}

/// Simplifies the triangles of one block. Keeps them if all points coincide, or if too many have
/// the same hash. Floats are relative to the block's box, so that a block far from the origin loses
/// nothing. Their rounding influences the choice of points only.
void SimplifyBlock(std::span<const double> points, double error,
                   std::vector<std::uint32_t>& triangles) {
  const Box box = BoxOf(points, triangles);
  const double extent = ExtentOf(box);
  if (extent == 0) return;  // Possible if coordinates are rounded.
  std::vector<std::uint32_t> used = triangles;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<float> positions;
  positions.reserve(3 * used.size());
  for (const std::uint32_t point : used) {
    const Vec3 within = (1 / extent) * (Vec3At(points, point) - box.low);
    for (const double value : {within.x, within.y, within.z}) {
      positions.push_back(static_cast<float>(value));
    }
  }
  if (HasManyCollisions(positions)) return;
  for (std::uint32_t& point : triangles) {
    point = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), point) -
                                       used.begin());
  }
  std::vector<std::uint32_t> output(triangles.size());
  output.resize(meshopt_simplify(output.data(), triangles.data(), triangles.size(),
                                 positions.data(), used.size(), 3 * sizeof(float), 0,
                                 static_cast<float>(std::min(error / extent, kMostError)),
                                 meshopt_SimplifyLockBorder, nullptr));
  for (std::uint32_t& point : output) point = used[point];
  triangles.swap(output);
}

/// A triangle, and the block of its first corner.
struct Placed {
  std::array<std::int64_t, 3> block;
  std::uint32_t triangle;
  friend auto operator<=>(const Placed&, const Placed&) = default;
};

void SimplifyEachBlock(std::span<const double> points, double error, double side,
                       const Vec3& origin, std::vector<std::uint32_t>& triangles) {
  std::vector<Placed> placed;
  placed.reserve(triangles.size() / 3);
  for (std::uint32_t t = 0; t < triangles.size() / 3; ++t) {
    const Vec3 at = (1 / side) * (Vec3At(points, triangles[3 * t]) - origin);
    const auto floor = [](double value) { return static_cast<std::int64_t>(std::floor(value)); };
    placed.push_back({{floor(at.x), floor(at.y), floor(at.z)}, t});
  }
  std::sort(placed.begin(), placed.end());
  std::vector<std::vector<std::uint32_t>> blocks;
  for (std::size_t k = 0; k < placed.size(); ++k) {
    if (k == 0 || placed[k].block != placed[k - 1].block) blocks.emplace_back();
    const auto corner = triangles.begin() + 3 * std::size_t{placed[k].triangle};
    blocks.back().insert(blocks.back().end(), corner, corner + 3);
  }
  ParallelFor(blocks.size(), [&](std::size_t k) { SimplifyBlock(points, error, blocks[k]); });
  triangles.clear();
  for (const std::vector<std::uint32_t>& block : blocks) {
    triangles.insert(triangles.end(), block.begin(), block.end());
  }
}

}  // namespace

void SimplifyInBlocks(std::span<const double> points, const BlockLimits& limits,
                      std::vector<std::uint32_t>& triangles) {
  if (triangles.empty()) return;
  const Box box = BoxOf(points, triangles);
  const double side = std::max(kBlock * limits.error, limits.least_block);
  if (ExtentOf(box) <= side) return SimplifyBlock(points, limits.error, triangles);
  SimplifyEachBlock(points, limits.error, side, box.low, triangles);
  const double half = side / 2;
  SimplifyEachBlock(points, limits.error, side, box.low - Vec3{half, half, half}, triangles);
}

}  // namespace partiemc::simplify
