#include "field.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "level_set_formula.h"
#include "near_entries.h"
#include "parallel.h"
#include "tile_kernels.h"

namespace partiemc {
namespace {

// Null where they are uniform.
const float* WeightsOf(const ParticleBins& bins) {
  return bins.weight.empty() ? nullptr : bins.weight.data();
}

TileEntries EntriesOf(const ParticleBins& bins, std::uint32_t tile) {
  const std::uint32_t first = bins.offsets[tile];
  const float* const weights = WeightsOf(bins);
  return {bins.entries.data() + first, weights == nullptr ? nullptr : weights + first,
          bins.CountOf(tile)};
}

// What a sum of kernels is worth: with weights of their own, particles bring them along.
float WeightOf(const ParticleBins& bins, const Scale& scale) {
  return bins.weight.empty() ? static_cast<float>(scale.uniform_weight) : 1.0f;
}

// First pass: the kernels of a tile's own particles, or of all around it where they reach too far
// for the margin of the sums.
void SumTile(const ParticleBins& bins, float radius, std::uint32_t tile, LevelSet& level_set) {
  std::array<float, kTileNodes>& values = level_set.tiles[tile];
  const bool fits = radius <= kSumMargin;
  if (fits && bins.CountOf(tile) == 0) {
    values.fill(0);
    return;
  }
  alignas(64) NodeSums sums;
  sums.fill(0);
  if (fits) {
    ScatterKernels(EntriesOf(bins, tile), radius, sums);
    level_set.rims.Keep(tile, sums);
  } else {
    NearWalk(bins, tile, nullptr).InAnyOrder([&](const NearEntries& near) {
      ScatterNearKernels(near, WeightsOf(bins), radius, sums);
    });
  }
  for (int j = 0; j < kTileSize; ++j) {
    std::copy_n(sums.data() + SumIndex(0, j), kTileSize, values.data() + j * kTileSize);
  }
}

// Second pass: the density at every node, and what follows from it alone.
void ClassifyTile(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                  LevelSet& level_set) {
  float* const values = level_set.tiles[tile].data();
  if (static_cast<float>(scale.kernel_radius) <= kSumMargin)
    level_set.rims.AddTo(bins.tiles, tile, values);
  ClassifyNodes(WeightOf(bins, scale), scale, values, level_set.sure_inside[tile],
                level_set.sure_outside[tile]);
  level_set.inside[tile] = level_set.sure_inside[tile];
}

// The nodes of which not all four neighbours and the node itself are in the class of `rows`, where
// nodes of tiles that do not exist are all in it or all not.
BitRows Uneven(const TileDirectory& directory, const std::vector<BitRows>& rows, bool beyond,
               std::uint32_t tile) {
  const Neighbourhood& near = directory.neighbours(tile);
  const auto row = [&](std::uint32_t of, int j) {
    return of != kNoTile ? rows[of][j] : beyond ? ~std::uint32_t{0} : 0;
  };
  BitRows uneven;
  std::uint32_t below = row(near[1], kTileSize - 1);
  for (int j = 0; j < kTileSize; ++j) {
    const std::uint32_t here = rows[tile][j];
    const std::uint32_t above = j + 1 < kTileSize ? rows[tile][j + 1] : row(near[7], 0);
    const std::uint32_t left = here << 1 | row(near[3], j) >> (kTileSize - 1);
    const std::uint32_t right = here >> 1 | row(near[5], j) << (kTileSize - 1);
    uneven[j] = ~(here & below & above & left & right);
    below = here;
  }
  return uneven;
}

// The nodes whose exact value may be asked for: the density leaves the side open of them or of a
// neighbour, or a neighbour is on the other side.
BitRows BandOf(const TileDirectory& directory, const LevelSet& level_set, std::uint32_t tile) {
  BitRows band = Uneven(directory, level_set.sure_inside, false, tile);
  const BitRows other = Uneven(directory, level_set.sure_outside, true, tile);
  for (int j = 0; j < kTileSize; ++j) band[j] &= other[j];
  return band;
}

void Clear(MomentSums& sums, bool weighted) {
  for (NodeSums* const channel :
       {&sums.kernel, &sums.moment_x, &sums.moment_y, &sums.xx, &sums.xy, &sums.yy}) {
    channel->fill(0);
  }
  if (weighted) sums.weighted.fill(0);
}

// Third pass: F at the nodes of `band`.
void SampleBand(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                const BitRows& band, LevelSet& level_set) {
  MomentSums sums;
  Clear(sums, !bins.weight.empty());
  CellMask mask;
  const int reach = static_cast<int>(std::ceil(scale.kernel_radius));
  const bool masked = reach < kMaskMargin;
  // A node is reached from the cells whose far side is less than the radius before it.
  if (masked) mask = Widened(band, reach, reach - 1);
  NearWalk(bins, tile, masked ? &mask : nullptr).InOrder([&](const NearEntries& near) {
    ScatterNearMoments(near, WeightsOf(bins), static_cast<float>(scale.kernel_radius), sums);
  });
  const LevelSetFormula<float> formula(scale);
  const NodeSums& weighted = bins.weight.empty() ? sums.kernel : sums.weighted;
  const float weight = WeightOf(bins, scale);
  const auto reference_radius = static_cast<float>(scale.reference_radius);
  const auto inverse_square = static_cast<float>(1 / (scale.kernel_radius * scale.kernel_radius));
  for (int j = 0; j < kTileSize; ++j) {
    for (std::uint32_t bits = band[j]; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      const int node = SumIndex(i, j);
      const float k = sums.kernel[node];
      float value = level_set.void_value;
      if (k > 0) {
        const float mean_x = sums.moment_x[node] / k;
        const float mean_y = sums.moment_y[node] / k;
        const float phi = std::sqrt(mean_x * mean_x + mean_y * mean_y) - reference_radius;
        const float share = inverse_square / k;
        const float spread =
            LargerEigenvalue(sums.xx[node] * share, sums.xy[node] * share, sums.yy[node] * share);
        value = formula.Value(weight * weighted[node], phi, spread);
      }
      level_set.tiles[tile][j * kTileSize + i] = value;
      const std::uint32_t bit = std::uint32_t{1} << i;
      std::uint32_t& inside = level_set.inside[tile][j];
      inside = value < 0 ? inside | bit : inside & ~bit;
    }
  }
}

template <typename Visit>
void ForEachTile(const ParticleBins& bins, Visit visit) {
  ParallelFor(static_cast<std::uint32_t>(bins.tiles.size()), visit);
}

}  // namespace

void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set) {
  const std::size_t tiles = bins.tiles.size();
  level_set.void_value = static_cast<float>(scale.VoidValue());
  level_set.tiles.resize(tiles);
  level_set.inside.resize(tiles);
  level_set.sure_inside.resize(tiles);
  level_set.sure_outside.resize(tiles);
  const auto radius = static_cast<float>(scale.kernel_radius);
  if (radius <= kSumMargin) level_set.rims.Prepare(bins, radius);
  ForEachTile(bins, [&](std::uint32_t tile) { SumTile(bins, radius, tile, level_set); });
  ForEachTile(bins, [&](std::uint32_t tile) { ClassifyTile(bins, scale, tile, level_set); });
  ForEachTile(bins, [&](std::uint32_t tile) {
    const BitRows band = BandOf(bins.tiles, level_set, tile);
    if (!IsEmpty(band)) SampleBand(bins, scale, tile, band, level_set);
  });
}

}  // namespace partiemc
