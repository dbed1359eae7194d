#include "field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

using NodeValues = std::array<float, kTileNodes>;

// Kernel sums at the nodes of one tile. The mean is relative to the node, so that it loses no
// digits where the tile's corner is far.
struct KernelSums {
  NodeValues weight;    // sum k
  NodeValues moment_x;  // sum k (x_i - x)
  NodeValues moment_y;
  NodeValues density;  // sum w k; used only where weights differ from particle to particle
};

// Nodes of a row or column that a particle at `centre` reaches, clipped to the tile.
struct NodeRange {
  int first, last;  // Inclusive; empty when last < first.
};

NodeRange NodesReached(float centre, float radius) {
  const int first = static_cast<int>(std::ceil(centre - radius));
  const int last = static_cast<int>(std::floor(centre + radius));
  return {std::max(first, 0), std::min(last, kTileSize - 1)};
}

template <bool kWeighted>
void ScatterParticle(float x, float y, float w, float radius, float inverse_square,
                     KernelSums& sums) {
  const NodeRange columns = NodesReached(x, radius);
  const NodeRange rows = NodesReached(y, radius);
  for (int j = rows.first; j <= rows.last; ++j) {
    const float dy = y - static_cast<float>(j);
    const int row = j * kTileSize;
    for (int i = columns.first; i <= columns.last; ++i) {
      const float dx = x - static_cast<float>(i);
      const float t = std::max(0.0f, 1.0f - (dx * dx + dy * dy) * inverse_square);
      const float k = t * t * t;
      sums.weight[row + i] += k;
      sums.moment_x[row + i] += k * dx;
      sums.moment_y[row + i] += k * dy;
      if constexpr (kWeighted) sums.density[row + i] += w * k;
    }
  }
}

void ScatterTile(const ParticleBins& bins, std::size_t tile, const Scale& scale, KernelSums& sums) {
  const auto radius = static_cast<float>(scale.kernel_radius);
  const auto inverse_square = static_cast<float>(1 / (scale.kernel_radius * scale.kernel_radius));
  sums.weight.fill(0);
  sums.moment_x.fill(0);
  sums.moment_y.fill(0);
  sums.density.fill(0);
  for (std::uint32_t e = bins.offsets[tile]; e < bins.offsets[tile + 1]; ++e) {
    if (bins.weight.empty()) {
      ScatterParticle<false>(bins.x[e], bins.y[e], 0, radius, inverse_square, sums);
    } else {
      ScatterParticle<true>(bins.x[e], bins.y[e], bins.weight[e], radius, inverse_square, sums);
    }
  }
}

void LevelSetOfTile(const KernelSums& sums, bool weighted, const Scale& scale, NodeValues& values) {
  const auto reference_radius = static_cast<float>(scale.reference_radius);
  const auto uniform_weight = static_cast<float>(scale.uniform_weight);
  const auto guard = static_cast<float>(scale.guard);
  const auto slope = static_cast<float>(scale.guard_slope);
  const auto void_value = static_cast<float>(scale.VoidValue());
  for (int node = 0; node < kTileNodes; ++node) {
    const float k = sums.weight[node];
    if (k <= 0) {
      values[node] = void_value;
      continue;
    }
    const float mean_x = sums.moment_x[node] / k;
    const float mean_y = sums.moment_y[node] / k;
    const float phi = std::sqrt(mean_x * mean_x + mean_y * mean_y) - reference_radius;
    const float f = weighted ? sums.density[node] : uniform_weight * k;
    values[node] = std::max(phi, (guard - f) * slope);
  }
}

}  // namespace

void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set) {
  level_set.void_value = static_cast<float>(scale.VoidValue());
  level_set.tiles.resize(bins.tiles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bins.tiles.size()),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      KernelSums sums;
                      for (std::size_t tile = range.begin(); tile < range.end(); ++tile) {
                        ScatterTile(bins, tile, scale, sums);
                        LevelSetOfTile(sums, !bins.weight.empty(), scale, level_set.tiles[tile]);
                      }
                    });
}

}  // namespace partiemc
