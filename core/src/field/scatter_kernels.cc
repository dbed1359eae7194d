#include <algorithm>
#include <array>
#include <cmath>

#include "field/tile_kernels.h"

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/scatter_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row of a kernel with R = 3 has six nodes, so more than eight lanes would idle.
using Lanes = hn::CappedTag<float, 8>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

// The first node after `coordinate`. The offset makes the number positive, so that truncation
// rounds down: particles are at most a tile away from the tile, and kernels reach at most a tile.
HWY_INLINE int NodeAfter(float coordinate) {
  constexpr int kOffset = 2 * kTileSize;
  return static_cast<int>(coordinate + kOffset) - kOffset + 1;
}

// NodeAfter in vectors.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> NodesAfter(D d, hn::Vec<D> coordinates) {
  constexpr int kOffset = 2 * kTileSize;
  const hn::RebindToSigned<D> d_int;
  const auto shifted = hn::Add(coordinates, hn::Set(d, static_cast<float>(kOffset)));
  return hn::Add(hn::ConvertTo(d_int, shifted), hn::Set(d_int, 1 - kOffset));
}

HWY_INLINE void AddTo(float* HWY_RESTRICT sums, Vector term) {
  const Lanes d;
  hn::StoreU(hn::Add(hn::LoadU(d, sums), term), d, sums);
}

// Adds the kernel of a particle to a block of `rows` x `columns` sums that begins at `sums`; x and
// y are relative to the first node of the block. k = max(0, row term - column term)^3 with the
// terms 1 - dy^2 / R^2 and dx^2 / R^2.
template <bool kWeighted>
HWY_INLINE void AddKernel(float x, float y, int columns, int rows, float inverse_square,
                          float weight, float* HWY_RESTRICT sums) {
  const Lanes d;
  const Vector lane = hn::Iota(d, 0.0f);
  const Vector scale = hn::Set(d, inverse_square);
  alignas(64) std::array<float, kTileSize> row_terms;
  for (int row = 0; row < rows; row += kLanes) {
    const Vector dy = hn::Sub(hn::Set(d, y), hn::Add(hn::Set(d, static_cast<float>(row)), lane));
    hn::StoreU(hn::Sub(hn::Set(d, 1.0f), hn::Mul(hn::Mul(dy, dy), scale)), d,
               row_terms.data() + row);
  }
  for (int column = 0; column < columns; column += kLanes) {
    const Vector dx = hn::Sub(hn::Set(d, x - static_cast<float>(column)), lane);
    // After the last column the term is 2, which exceeds any row term, so k = 0 for every
    // instruction set.
    const auto reached = hn::Lt(lane, hn::Set(d, static_cast<float>(columns - column)));
    const Vector column_term =
        hn::IfThenElse(reached, hn::Mul(hn::Mul(dx, dx), scale), hn::Set(d, 2.0f));
    for (int row = 0; row < rows; ++row) {
      const Vector t = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, row_terms[row]), column_term));
      Vector k = hn::Mul(hn::Mul(t, t), t);
      if constexpr (kWeighted) k = hn::Mul(k, hn::Set(d, weight));
      AddTo(sums + row * kSumColumns + column, k);
    }
  }
}

// Particles per block.
constexpr int kBlock = 64;

// By particle: its position relative to the first node that its kernel reaches (column and row),
// and the index of the sum of this node.
struct KernelCorners {
  alignas(64) std::array<float, kBlock> x, y;
  alignas(64) std::array<std::int32_t, kBlock> at;
};

HWY_INLINE void FindCorners(const BinnedParticle* particles, int count, float radius,
                            KernelCorners& corners) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> d_int;
  const auto step = static_cast<int>(hn::Lanes(d));
  int k = 0;
  for (; k + step <= count; k += step) {
    hn::Vec<decltype(d)> x, y, source;
    hn::LoadInterleaved3(d, &particles[k].x, x, y, source);
    const auto column = NodesAfter(d, hn::Sub(x, hn::Set(d, radius)));
    const auto row = NodesAfter(d, hn::Sub(y, hn::Set(d, radius)));
    hn::StoreU(hn::Sub(x, hn::ConvertTo(d, column)), d, corners.x.data() + k);
    hn::StoreU(hn::Sub(y, hn::ConvertTo(d, row)), d, corners.y.data() + k);
    const auto in_row = hn::Add(column, hn::Set(d_int, SumIndex(0, 0)));
    hn::StoreU(hn::Add(hn::Mul(row, hn::Set(d_int, kSumColumns)), in_row), d_int,
               corners.at.data() + k);
  }
  for (; k < count; ++k) {
    const int column = NodeAfter(particles[k].x - radius);
    const int row = NodeAfter(particles[k].y - radius);
    corners.x[k] = particles[k].x - static_cast<float>(column);
    corners.y[k] = particles[k].y - static_cast<float>(row);
    corners.at[k] = SumIndex(column, row);
  }
}

// Calls add(x, y, index, first sum) for each particle of a tile. Requires: kernels fit the margin.
// Every kernel covers the same number of rows and columns, so no branch depends on the position of
// a particle.
template <typename Add>
HWY_INLINE void ForEachCorner(const TileParticles& tile, float radius, NodeSums& sums, Add add) {
  KernelCorners corners;
  const auto count = static_cast<int>(tile.count);
  for (int first = 0; first < count; first += kBlock) {
    const int in_block = std::min(kBlock, count - first);
    FindCorners(tile.particles + first, in_block, radius, corners);
    for (int k = 0; k < in_block; ++k) {
      add(corners.x[k], corners.y[k], first + k, sums.data() + corners.at[k]);
    }
  }
}

// Narrow kernels in vectors of sixteen: two rows of eight nodes at a time, with the same operations
// per node.
#if HWY_TARGET <= HWY_AVX3
constexpr int kNarrowSpan = kLanes;

template <bool kWeighted, int kPairs>
void ScatterNarrow(const TileParticles& tile, float radius, int span, NodeSums& sums) {
  const hn::CappedTag<float, 2 * kLanes> d;
  const Lanes d_row;
  const auto inverse_square = hn::Set(d, 1 / (radius * radius));
  alignas(64) std::int32_t rows[kPairs][2 * kLanes];
  alignas(64) float columns[2 * kLanes];
  for (int lane = 0; lane < 2 * kLanes; ++lane) {
    for (int pair = 0; pair < kPairs; ++pair) rows[pair][lane] = 2 * pair + lane / kLanes;
    columns[lane] = static_cast<float>(lane % kLanes);
  }
  const auto lane = hn::Iota(d, 0.0f);
  const auto column = hn::Load(d, columns);
  const auto reached_row = hn::Lt(lane, hn::Set(d, static_cast<float>(span)));
  const auto reached_column = hn::Lt(column, hn::Set(d, static_cast<float>(span)));
  ForEachCorner(tile, radius, sums, [&](float x, float y, int k, float* at) HWY_ATTR {
    const auto dx = hn::Sub(hn::Set(d, x), column);
    const auto dy = hn::Sub(hn::Set(d, y), lane);
    // These terms make k = 0 outside the span for every instruction set.
    const auto column_term =
        hn::IfThenElse(reached_column, hn::Mul(hn::Mul(dx, dx), inverse_square), hn::Set(d, 2.0f));
    const auto row_terms = hn::IfThenElseZero(
        reached_row, hn::Sub(hn::Set(d, 1.0f), hn::Mul(hn::Mul(dy, dy), inverse_square)));
    for (int pair = 0; pair < kPairs; ++pair) {
      const auto row_term = hn::TableLookupLanes(row_terms, hn::SetTableIndices(d, rows[pair]));
      const auto t = hn::Max(hn::Zero(d), hn::Sub(row_term, column_term));
      auto kernel = hn::Mul(hn::Mul(t, t), t);
      if constexpr (kWeighted) kernel = hn::Mul(kernel, hn::Set(d, tile.weight[k]));
      AddTo(at + 2 * pair * kSumColumns, hn::LowerHalf(kernel));
      AddTo(at + (2 * pair + 1) * kSumColumns, hn::UpperHalf(d_row, kernel));
    }
  });
}

template <bool kWeighted>
void ScatterNarrowOf(const TileParticles& tile, float radius, int span, NodeSums& sums) {
  const auto scatter = span <= 2   ? ScatterNarrow<kWeighted, 1>
                       : span <= 4 ? ScatterNarrow<kWeighted, 2>
                       : span <= 6 ? ScatterNarrow<kWeighted, 3>
                                   : ScatterNarrow<kWeighted, 4>;
  scatter(tile, radius, span, sums);
}
#else
constexpr int kNarrowSpan = 0;
template <bool kWeighted>
void ScatterNarrowOf(const TileParticles&, float, int, NodeSums&) {}
#endif

template <bool kWeighted>
void ScatterKernelsOf(const TileParticles& tile, float radius, NodeSums& sums) {
  const int span = static_cast<int>(std::ceil(2 * radius));
  if (span <= kNarrowSpan) return ScatterNarrowOf<kWeighted>(tile, radius, span, sums);
  const float inverse_square = 1 / (radius * radius);
  ForEachCorner(tile, radius, sums, [&](float x, float y, int k, float* at) HWY_ATTR {
    AddKernel<kWeighted>(x, y, span, span, inverse_square, kWeighted ? tile.weight[k] : 1.0f, at);
  });
}

// The nodes in columns and rows [low, high) that the kernel of a particle at (x, y) reaches.
struct KernelNodes {
  int column, row, columns, rows;

  HWY_INLINE KernelNodes(float x, float y, float radius, int low, int high)
      : column(std::max(NodeAfter(x - radius), low)),
        row(std::max(NodeAfter(y - radius), low)),
        columns(std::min(NodeAfter(x + radius), high) - column),
        rows(std::min(NodeAfter(y + radius), high) - row) {}
};

// Adds the kernel of one particle at its nodes.
template <bool kWeighted>
HWY_INLINE void AddAtNodes(float x, float y, const KernelNodes& at, float inverse_square,
                           float weight, NodeSums& sums) {
  AddKernel<kWeighted>(x - static_cast<float>(at.column), y - static_cast<float>(at.row),
                       at.columns, at.rows, inverse_square, weight,
                       sums.data() + SumIndex(at.column, at.row));
}

void ScatterSizedKernels(const TileParticles& tile, float radius, NodeSums& sums) {
  for (std::size_t k = 0; k < tile.count; ++k) {
    const auto& [x, y, source] = tile.particles[k];
    const float reach = radius * tile.size[k];
    const KernelNodes at(x, y, reach, -kSumMargin, kTileSize + kSumMargin);
    AddAtNodes<false>(x, y, at, 1 / (reach * reach), 1, sums);
  }
}

void ScatterKernels(const TileParticles& tile, float radius, NodeSums& sums) {
  if (tile.size != nullptr) return ScatterSizedKernels(tile, radius, sums);
  tile.weight != nullptr ? ScatterKernelsOf<true>(tile, radius, sums)
                         : ScatterKernelsOf<false>(tile, radius, sums);
}

template <bool kWeighted>
void ScatterNearKernelsOf(const ParticleBlock& near, const float* weight, float radius,
                          NodeSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  for (int p = 0; p < near.count; ++p) {
    const float x = near.x[p], y = near.y[p];
    const KernelNodes at(x, y, radius, 0, kTileSize);
    AddAtNodes<kWeighted>(x, y, at, inverse_square, kWeighted ? weight[near.particle[p]] : 1.0f,
                          sums);
  }
}

void ScatterNearSizedKernels(const ParticleBlock& near, float radius, NodeSums& sums) {
  for (int p = 0; p < near.count; ++p) {
    const float x = near.x[p], y = near.y[p];
    const float reach = radius * near.size[p];
    const KernelNodes at(x, y, reach, 0, kTileSize);
    if (at.columns <= 0 || at.rows <= 0) continue;
    AddAtNodes<false>(x, y, at, 1 / (reach * reach), 1, sums);
  }
}

void ScatterNearKernels(const ParticleBlock& near, const float* weight, float radius,
                        NodeSums& sums) {
  weight != nullptr ? ScatterNearKernelsOf<true>(near, weight, radius, sums)
                    : ScatterNearKernelsOf<false>(near, weight, radius, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ScatterKernels);
HWY_EXPORT(ScatterNearKernels);
HWY_EXPORT(ScatterNearSizedKernels);

void ScatterKernels(const TileParticles& tile, float radius, NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterKernels)(tile, radius, sums);
}

void ScatterNearKernels(const ParticleBlock& near, const float* weight, float radius,
                        NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearKernels)(near, weight, radius, sums);
}

void ScatterNearSizedKernels(const ParticleBlock& near, float radius, NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearSizedKernels)(near, radius, sums);
}

}  // namespace partiemc
#endif  // HWY_ONCE
