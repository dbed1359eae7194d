#include "field/field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "base/parallel.h"
#include "base/prefetch.h"
#include "bins/masked_particles.h"
#include "field/level_set_formula.h"
#include "field/tile_kernels.h"

namespace partiemc {
namespace {

// The last pass that has run over a tile.
enum Passes : std::uint8_t { kNone, kSummed, kClassified, kSampled };

// Tiles per task: enough that most tiles have all neighbours in the same task.
constexpr std::size_t kTilesAtOnce = 64;

// Whether all particles have the same weight in the density. With own sizes they do: the density
// then does not use `bins.weight`.
bool HasUniformWeights(const ParticleBins& bins) {
  return bins.weight.empty() || !bins.size.empty();
}

// Null if weights are uniform.
const float* WeightsOf(const ParticleBins& bins) {
  return HasUniformWeights(bins) ? nullptr : bins.weight.data();
}

// Null if sizes are equal.
const float* SizesOf(const ParticleBins& bins) {
  return bins.size.empty() ? nullptr : bins.size.data();
}

TileParticles ParticlesOf(const ParticleBins& bins, std::uint32_t tile) {
  const std::uint32_t first = bins.offsets[tile];
  const auto from = [first](const float* values) {
    return values == nullptr ? nullptr : values + first;
  };
  return {bins.particles.data() + first, from(WeightsOf(bins)), from(SizesOf(bins)),
          bins.CountOf(tile)};
}

// Factor from kernel sums to density; 1 if the sums are weighted.
float WeightOf(const ParticleBins& bins, const Scale& scale) {
  return HasUniformWeights(bins) ? static_cast<float>(scale.uniform_weight) : 1.0f;
}

// Whether the kernels of a tile's particles reach no farther than the margin of its sums.
bool FitMargin(const Scale& scale) { return static_cast<float>(scale.reach) <= kSumMargin; }

// First pass: sums the kernels of a tile's own particles, or of all particles around it if kernels
// reach beyond the margin of the sums.
void SumTile(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
             LevelSet& level_set) {
  std::array<float, kTileNodes>& values = level_set.tiles[tile];
  const auto radius = static_cast<float>(scale.kernel_radius);
  const bool fits = FitMargin(scale);
  if (fits && bins.CountOf(tile) == 0) {
    values.fill(0);
    return;
  }
  // Prefetches the values that are written at the end: the sums take longer than this fetch.
  PrefetchLines(std::span<const float>(values));
  alignas(64) NodeSums sums;
  sums.fill(0);
  if (fits) {
    level_set.halo.Prefetch(tile);
    ScatterKernels(ParticlesOf(bins, tile), radius, sums);
    level_set.halo.Keep(tile, sums);
  } else {
    MaskedParticles(bins, tile, nullptr, radius).ForEachBlock([&](const ParticleBlock& near) {
      bins.size.empty() ? ScatterNearKernels(near, WeightsOf(bins), radius, sums)
                        : ScatterNearSizedKernels(near, radius, sums);
    });
  }
  // memcpy of a fixed size is inlined, unlike copy_n.
  for (int j = 0; j < kTileSize; ++j) {
    std::memcpy(values.data() + j * kTileSize, sums.data() + SumIndex(0, j),
                kTileSize * sizeof(float));
  }
}

// First part of the second pass: adds the density from neighbouring tiles, and sets the sides that
// the density decides.
void ClassifyByDensity(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                       LevelSet& level_set) {
  float* const values = level_set.tiles[tile].data();
  if (FitMargin(scale)) level_set.halo.AddTo(bins.tiles, tile, values);
  ClassifyNodes(WeightOf(bins, scale), scale, values, level_set.inside[tile], level_set.open[tile]);
}

// Calls visit(node, i, j) for the requested nodes (i, j) of a tile in a block; `node` is the number
// in the block.
template <typename Visit>
void ForEachAsked(const NodeBlock& block, Visit visit) {
  for (std::uint32_t asked = block.asked; asked != 0; asked &= asked - 1) {
    const int node = std::countr_zero(asked);
    visit(node, block.column + node % NodeBlock::kSide, block.row + node / NodeBlock::kSide);
  }
}

// Lowers F at the requested nodes to the distance from the surface of the nearest grain, if this is
// less. Returns `inside` with the nodes at which F is then negative.
BitRows JoinGrains(const NodeBlocks& blocks, const GrainDistances& distances, BitRows inside,
                   float* values) {
  for (int b = 0; b < blocks.count; ++b) {
    ForEachAsked(blocks[b], [&](int node, int i, int j) {
      float& value = values[j * kTileSize + i];
      value = std::min(value, distances.blocks[b][node]);
      inside[j] |= static_cast<std::uint32_t>(value < 0) << i;
    });
  }
  return inside;
}

// Calls visit(block) for the particles whose kernels reach a requested node of a tile, and for some
// others.
template <typename Visit>
void ForEachNear(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                 const BitRows& asked, Visit visit) {
  CellMask mask = MaskOf(asked);
  const int reach = static_cast<int>(std::ceil(scale.reach));
  const bool masked = reach < kMaskMargin;
  // A kernel reaches node i from the cells i - reach to i + reach - 1: cell c extends from c to c +
  // 1.
  if (masked) Widen(mask, reach, reach - 1);
  MaskedParticles(bins, tile, masked ? &mask : nullptr, static_cast<float>(scale.kernel_radius))
      .ForEachBlock(visit);
}

// Computes F at the given nodes of a tile from their moments. Returns the nodes that are inside.
BitRows SampleNodes(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                    const AskedNodes& asked, LevelSet& level_set) {
  const NodeBlocks blocks = BlocksOf(asked.rows);
  MomentSums sums;
  std::fill_n(sums.begin(), blocks.count, BlockSums{});
  GrainDistances distances;
  if (scale.has_grains) {
    for (int b = 0; b < blocks.count; ++b) distances.blocks[b].fill(kTileSize);
  }
  const auto radius = static_cast<float>(scale.kernel_radius);
  ForEachNear(bins, scale, tile, asked.rows, [&](const ParticleBlock& near) {
    AddNearMoments(near, !bins.size.empty(), radius, blocks, asked.has_kernel_sums, sums);
    if (scale.has_grains) AddNearGrains(near, scale, blocks, distances);
  });
  float* const values = level_set.tiles[tile].data();
  const BitRows inside = EvaluateNodes(asked, blocks, sums, WeightOf(bins, scale), scale, values);
  return scale.has_grains ? JoinGrains(blocks, distances, inside, values) : inside;
}

// Second pass. Computes F immediately at the nodes whose side the density does not decide, while
// the sums are in the nearest cache.
void ClassifyTile(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                  LevelSet& level_set) {
  ClassifyByDensity(bins, scale, tile, level_set);
  level_set.passes[tile] = kClassified;
  const BitRows& open = level_set.open[tile];
  if (IsEmpty(open)) return;
  const BitRows inside =
      SampleNodes(bins, scale, tile, {open, true, HasUniformWeights(bins)}, level_set);
  for (int j = 0; j < kTileSize; ++j) level_set.inside[tile][j] |= inside[j];
}

// The ends of crossed edges: the nodes of a tile with a neighbour node on the other side.
BitRows EndsOfCrossedEdges(const TileDirectory& directory, const LevelSet& level_set,
                           std::uint32_t tile) {
  const Neighbourhood& near = directory.neighbours(tile);
  const auto row = [&](std::uint32_t of, int j) {
    return of != kNoTile ? level_set.inside[of][j] : 0;
  };
  BitRows ends;
  std::uint32_t below = row(near[1], kTileSize - 1);
  for (int j = 0; j < kTileSize; ++j) {
    const std::uint32_t here = level_set.inside[tile][j];
    const std::uint32_t above = j + 1 < kTileSize ? level_set.inside[tile][j + 1] : row(near[7], 0);
    const std::uint32_t left = here << 1 | row(near[3], j) >> (kTileSize - 1);
    const std::uint32_t right = here >> 1 | row(near[5], j) << (kTileSize - 1);
    ends[j] = (here ^ below) | (here ^ above) | (here ^ left) | (here ^ right);
    below = here;
  }
  return ends;
}

// Third pass: computes F at those ends of crossed edges whose side the density decided.
void SampleDecidedEnds(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                       LevelSet& level_set) {
  level_set.passes[tile] = kSampled;
  BitRows ends = EndsOfCrossedEdges(bins.tiles, level_set, tile);
  for (int j = 0; j < kTileSize; ++j) ends[j] &= ~level_set.open[tile][j];
  if (!IsEmpty(ends)) SampleNodes(bins, scale, tile, {ends, false, false}, level_set);
}

// Runs the passes over the tiles [first, last). A pass over a tile reads the results of the
// previous pass in the neighbouring tiles. The pass runs as soon as these results are ready, while
// they are in a near cache. Tiles with neighbours in other ranges are left for later, because other
// tasks compute these neighbours.
void SampleTiles(const ParticleBins& bins, const Scale& scale, std::uint32_t first,
                 std::uint32_t last, LevelSet& level_set) {
  // The neighbourhood includes the tile itself.
  const auto last_around = [&](std::uint32_t tile) {
    std::uint32_t result = tile;
    for (const std::uint32_t near : bins.tiles.neighbours(tile)) {
      if (near != kNoTile) result = std::max(result, near);
    }
    return result;
  };
  const auto are_around = [&](std::uint32_t tile, Passes passes) {
    return std::ranges::all_of(bins.tiles.neighbours(tile), [&](std::uint32_t near) {
      return near >= first && (near == kNoTile || level_set.passes[near] >= passes);
    });
  };
  std::uint32_t classified = first, sampled = first;
  for (std::uint32_t tile = first; tile < last; ++tile) {
    SumTile(bins, scale, tile, level_set);
    level_set.passes[tile] = kSummed;
    for (; classified <= tile && last_around(classified) <= tile; ++classified) {
      if (are_around(classified, kSummed)) ClassifyTile(bins, scale, classified, level_set);
    }
    for (; sampled < classified && last_around(sampled) < classified; ++sampled) {
      if (are_around(sampled, kClassified)) SampleDecidedEnds(bins, scale, sampled, level_set);
    }
  }
}

}  // namespace

void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set) {
  const std::size_t tiles = bins.tiles.size();
  level_set.void_value = static_cast<float>(VoidValue(scale));
  level_set.tiles.resize(tiles);
  level_set.inside.resize(tiles);
  level_set.open.resize(tiles);
  level_set.passes.assign(tiles, 0);
  if (FitMargin(scale)) level_set.halo.Prepare(bins, static_cast<float>(scale.reach));
  ParallelForRanges(tiles, kTilesAtOnce, [&](std::size_t first, std::size_t last) {
    SampleTiles(bins, scale, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                level_set);
  });
  const auto for_the_rest = [&](Passes before, auto pass) {
    ParallelFor(static_cast<std::uint32_t>(tiles), [&](std::uint32_t tile) {
      if (level_set.passes[tile] == before) pass(bins, scale, tile, level_set);
    });
  };
  for_the_rest(kSummed, ClassifyTile);
  for_the_rest(kClassified, SampleDecidedEnds);
}

void FindLocalSizes(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                    const BitRows& asked, std::array<float, kTileNodes>& sizes) {
  const NodeBlocks blocks = BlocksOf(asked);
  MomentSums sums;
  std::fill_n(sums.begin(), blocks.count, BlockSums{});
  ForEachNear(bins, scale, tile, asked, [&](const ParticleBlock& near) {
    AddNearMoments(near, true, static_cast<float>(scale.kernel_radius), blocks, false, sums);
  });
  for (int b = 0; b < blocks.count; ++b) {
    ForEachAsked(blocks[b], [&](int node, int i, int j) {
      const float kernel = sums[b].kernel[node];
      sizes[j * kTileSize + i] = kernel > 0 ? sums[b].size[node] / kernel : 0;
    });
  }
}

}  // namespace partiemc
