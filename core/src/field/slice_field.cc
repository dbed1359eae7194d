#include "field/slice_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"
#include "bins/masked_particles.h"
#include "field/level_set_formula.h"
#include "field/slice_formula.h"

namespace partiemc {
namespace {

using TileSums = std::array<SliceSums, kTileNodes>;

// The nodes [low, high) within `reach` of a coordinate.
struct NodeRange {
  int low, high;

  NodeRange(double coordinate, double reach)
      : low(std::clamp(static_cast<int>(std::ceil(coordinate - reach)), 0, kTileSize)),
        high(std::clamp(static_cast<int>(std::floor(coordinate + reach)) + 1, 0, kTileSize)) {}
};

void AddParticle(const Scale& scale, double x, double y, double height, double weight,
                 TileSums& sums) {
  const double inverse_square = 1 / (scale.kernel_radius * scale.kernel_radius);
  // 1 - s^2 at the point of the plane directly below the particle.
  const double foot = 1 - height * height * inverse_square;
  const double reach = scale.kernel_radius * std::sqrt(std::max(foot, 0.0));
  const NodeRange columns(x, reach), rows(y, reach);
  for (int j = rows.low; j < rows.high; ++j) {
    const double dy = y - j;
    const double in_row = foot - dy * dy * inverse_square;
    for (int i = columns.low; i < columns.high; ++i) {
      const double dx = x - i;
      const double within = in_row - dx * dx * inverse_square;
      if (within > 0) sums[j * kTileSize + i].Add({dx, dy, height}, within, weight);
    }
  }
}

void SampleTile(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                LevelSet& level_set) {
  TileSums sums{};
  MaskedParticles(bins, tile, nullptr).ForEachBlock([&](const ParticleBlock& near) {
    for (int k = 0; k < near.count; ++k) {
      const std::uint32_t particle = near.particle[k];
      const double weight = bins.weight.empty() ? scale.uniform_weight : bins.weight[particle];
      AddParticle(scale, near.x[k], near.y[k], bins.height[particle], weight, sums);
    }
  });
  level_set.open[tile] = {};
  BitRows& inside = level_set.inside[tile] = {};
  for (int node = 0; node < kTileNodes; ++node) {
    const auto value = static_cast<float>(sums[node].Value(scale));
    level_set.tiles[tile][node] = value;
    inside[node / kTileSize] |= std::uint32_t{value < 0} << node % kTileSize;
  }
}

}  // namespace

void SampleSlice(const ParticleBins& bins, const Scale& scale, LevelSet& level_set) {
  const std::size_t tiles = bins.tiles.size();
  level_set.void_value = static_cast<float>(VoidValue(scale));
  level_set.tiles.resize(tiles);
  level_set.inside.resize(tiles);
  level_set.open.resize(tiles);
  level_set.passes.assign(tiles, 0);
  ParallelFor(static_cast<std::uint32_t>(tiles),
              [&](std::uint32_t tile) { SampleTile(bins, scale, tile, level_set); });
}

}  // namespace partiemc
