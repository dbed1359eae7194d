#include <algorithm>
#include <array>
#include <cmath>

#include "field/tile_kernels.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/scatter_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "field/kernel_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// Particles whose first nodes are looked for together.
constexpr int kBlock = 64;

// Of particles of a tile: where they are relative to the first column and row that their kernels
// reach, and where that node's sum is.
struct KernelCorners {
  alignas(64) std::array<float, kBlock> x, y;
  alignas(64) std::array<std::int32_t, kBlock> at;
};

// Widens `rows`, of first rows, by those of these particles.
HWY_INLINE void FindCorners(const BinnedParticle* particles, int count, float radius,
                            KernelCorners& corners, NodeRange& rows) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> d_int;
  const auto step = static_cast<int>(hn::Lanes(d));
  auto lowest = hn::Set(d_int, rows.first);
  auto highest = hn::Set(d_int, rows.last);
  int k = 0;
  for (; k + step <= count; k += step) {
    hn::Vec<decltype(d)> x, y, source;
    hn::LoadInterleaved3(d, &particles[k].x, x, y, source);
    const auto column = NodesAfter(d, hn::Sub(x, hn::Set(d, radius)));
    const auto row = NodesAfter(d, hn::Sub(y, hn::Set(d, radius)));
    hn::StoreU(hn::Sub(x, hn::ConvertTo(d, column)), d, corners.x.data() + k);
    hn::StoreU(hn::Sub(y, hn::ConvertTo(d, row)), d, corners.y.data() + k);
    lowest = hn::Min(lowest, row);
    highest = hn::Max(highest, row);
    const auto in_row = hn::Add(column, hn::Set(d_int, SumIndex(0, 0)));
    hn::StoreU(hn::Add(hn::Mul(row, hn::Set(d_int, kSumColumns)), in_row), d_int,
               corners.at.data() + k);
  }
  rows = {hn::GetLane(hn::MinOfLanes(d_int, lowest)), hn::GetLane(hn::MaxOfLanes(d_int, highest))};
  for (; k < count; ++k) {
    const int column = NodeAfter(particles[k].x - radius);
    const int row = NodeAfter(particles[k].y - radius);
    corners.x[k] = particles[k].x - static_cast<float>(column);
    corners.y[k] = particles[k].y - static_cast<float>(row);
    corners.at[k] = SumIndex(column, row);
    rows = {std::min(rows.first, row), std::max(rows.last, row)};
  }
}

// Kernels that the margin has room for: every one covers the same number of rows and columns, so
// that no branch depends on where a particle lies. add(x, y, index, first sum) adds one. Returns
// the first rows of kernels, from the lowest to the highest.
template <typename Add>
HWY_INLINE NodeRange ForEachCorner(const TileParticles& particles, float radius, NodeSums& sums,
                                   Add add) {
  KernelCorners corners;
  NodeRange rows = {2 * kTileSize, -2 * kTileSize};
  const auto count = static_cast<int>(particles.count);
  for (int first = 0; first < count; first += kBlock) {
    const int in_block = std::min(kBlock, count - first);
    FindCorners(particles.particles + first, in_block, radius, corners, rows);
    for (int k = 0; k < in_block; ++k) {
      add(corners.x[k], corners.y[k], first + k, sums.data() + corners.at[k]);
    }
  }
  return rows;
}

// Narrow kernels in vectors of sixteen: two rows of eight nodes at a time, which takes the same
// steps for each node.
#if HWY_TARGET <= HWY_AVX3
constexpr int kNarrowSpan = kLanes;

template <bool kWeighted, int kPairs>
NodeRange ScatterNarrow(const TileParticles& particles, float radius, int span, NodeSums& sums) {
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
  return ForEachCorner(particles, radius, sums, [&](float x, float y, int k, float* at) HWY_ATTR {
    const auto dx = hn::Sub(hn::Set(d, x), column);
    const auto dy = hn::Sub(hn::Set(d, y), lane);
    // Beyond the span terms that make k = 0, on every target alike.
    const auto column_term =
        hn::IfThenElse(reached_column, hn::Mul(hn::Mul(dx, dx), inverse_square), hn::Set(d, 2.0f));
    const auto row_terms = hn::IfThenElseZero(
        reached_row, hn::Sub(hn::Set(d, 1.0f), hn::Mul(hn::Mul(dy, dy), inverse_square)));
    for (int pair = 0; pair < kPairs; ++pair) {
      const auto row_term = hn::TableLookupLanes(row_terms, hn::SetTableIndices(d, rows[pair]));
      const auto t = hn::Max(hn::Zero(d), hn::Sub(row_term, column_term));
      auto kernel = hn::Mul(hn::Mul(t, t), t);
      if constexpr (kWeighted) kernel = hn::Mul(kernel, hn::Set(d, particles.weight[k]));
      AddTo(at + 2 * pair * kSumColumns, hn::LowerHalf(kernel));
      AddTo(at + (2 * pair + 1) * kSumColumns, hn::UpperHalf(d_row, kernel));
    }
  });
}

template <bool kWeighted>
NodeRange ScatterNarrowOf(const TileParticles& particles, float radius, int span, NodeSums& sums) {
  const auto scatter = span <= 2   ? ScatterNarrow<kWeighted, 1>
                       : span <= 4 ? ScatterNarrow<kWeighted, 2>
                       : span <= 6 ? ScatterNarrow<kWeighted, 3>
                                   : ScatterNarrow<kWeighted, 4>;
  return scatter(particles, radius, span, sums);
}
#else
constexpr int kNarrowSpan = 0;
template <bool kWeighted>
NodeRange ScatterNarrowOf(const TileParticles&, float, int, NodeSums&) {
  return kNoNodes;
}
#endif

template <bool kWeighted>
NodeRange ScatterKernelsOf(const TileParticles& particles, float radius, int span, NodeSums& sums) {
  if (span <= kNarrowSpan) return ScatterNarrowOf<kWeighted>(particles, radius, span, sums);
  const float inverse_square = 1 / (radius * radius);
  alignas(64) RowTerms row_terms;
  return ForEachCorner(particles, radius, sums, [&](float x, float y, int k, float* at) HWY_ATTR {
    SetRowTerms(y, {0, span - 1}, inverse_square, row_terms);
    const float weight = kWeighted ? particles.weight[k] : 1.0f;
    for (int v = 0; v < span; v += kLanes) {
      const Vector column_term = ColumnTermsAt(x, v, span - 1, inverse_square).term;
      for (int row = 0; row < span; ++row) {
        AddRow<kWeighted>(hn::Set(Lanes(), row_terms[row]), column_term, weight,
                          at + row * kSumColumns + v);
      }
    }
  });
}

NodeRange ScatterKernels(const TileParticles& particles, float radius, NodeSums& sums) {
  const int span = static_cast<int>(std::ceil(2 * radius));
  const NodeRange firsts = particles.weight != nullptr
                               ? ScatterKernelsOf<true>(particles, radius, span, sums)
                               : ScatterKernelsOf<false>(particles, radius, span, sums);
  return {firsts.first, firsts.last + span - 1};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ScatterKernels);

NodeRange ScatterKernels(const TileParticles& particles, float radius, NodeSums& sums) {
  return HWY_DYNAMIC_DISPATCH(ScatterKernels)(particles, radius, sums);
}

}  // namespace partiemc
#endif  // HWY_ONCE
