#include "tile_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tile_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernel_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

HWY_INLINE NodeRange NodesReached(float centre, float radius) {
  return {std::max(NodeAfter(centre - radius), 0),
          std::min(NodeAfter(centre + radius) - 1, kTileSize - 1)};
}

// Calls visit(index among the near ones, column, row, terms of the columns from there, term of the
// row) for each vector of the tile's nodes that a kernel reaches.
template <typename Visit>
HWY_INLINE void ForEachReached(const NearEntries& near, float radius, Visit visit) {
  const float inverse_square = 1 / (radius * radius);
  alignas(64) RowTerms row_terms;
  for (int e = 0; e < near.count; ++e) {
    const float x = near.x[e];
    const float y = near.y[e];
    const NodeRange columns = NodesReached(x, radius);
    const NodeRange rows = NodesReached(y, radius);
    if (rows.last < rows.first) continue;
    SetRowTerms(y, rows, inverse_square, row_terms);
    for (int column = columns.first; column <= columns.last; column += kLanes) {
      const ColumnTerms terms = ColumnTermsAt(x, column, columns.last, inverse_square);
      for (int row = rows.first; row <= rows.last; ++row) {
        visit(e, column, row, terms, row_terms[row - rows.first]);
      }
    }
  }
}

template <bool kWeighted>
void ScatterNearKernelsOf(const NearEntries& near, const float* weight, float radius,
                          NodeSums& sums) {
  ForEachReached(
      near, radius,
      [&](int e, int column, int row, const ColumnTerms& terms, float row_term) HWY_ATTR {
        AddRow<kWeighted>(row_term, terms.term, kWeighted ? weight[near.entry[e]] : 1.0f,
                          sums.data() + SumIndex(column, row));
      });
}

void ScatterNearKernels(const NearEntries& near, const float* weight, float radius,
                        NodeSums& sums) {
  weight != nullptr ? ScatterNearKernelsOf<true>(near, weight, radius, sums)
                    : ScatterNearKernelsOf<false>(near, weight, radius, sums);
}

template <bool kWeighted>
void ScatterNearMomentsOf(const NearEntries& near, const float* weight, float radius,
                          MomentSums& sums) {
  const Lanes d;
  ForEachReached(
      near, radius,
      [&](int e, int column, int row, const ColumnTerms& terms, float row_term) HWY_ATTR {
        const Vector k = KernelAt(row_term, terms.term);
        const Vector dy = hn::Set(d, near.y[e] - static_cast<float>(row));
        const int at = SumIndex(column, row);
        AddTo(sums.kernel.data() + at, k);
        const Vector kx = hn::Mul(k, terms.dx);
        const Vector ky = hn::Mul(k, dy);
        AddTo(sums.moment_x.data() + at, kx);
        AddTo(sums.moment_y.data() + at, ky);
        AddTo(sums.xx.data() + at, hn::Mul(kx, terms.dx));
        AddTo(sums.xy.data() + at, hn::Mul(kx, dy));
        AddTo(sums.yy.data() + at, hn::Mul(ky, dy));
        if constexpr (kWeighted) {
          AddTo(sums.weighted.data() + at, hn::Mul(k, hn::Set(d, weight[near.entry[e]])));
        }
      });
}

void ScatterNearMoments(const NearEntries& near, const float* weight, float radius,
                        MomentSums& sums) {
  weight != nullptr ? ScatterNearMomentsOf<true>(near, weight, radius, sums)
                    : ScatterNearMomentsOf<false>(near, weight, radius, sums);
}

void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& sure_inside,
                   BitRows& sure_outside) {
  const Lanes d;
  const Vector guard = hn::Set(d, static_cast<float>(scale.guard));
  const Vector saturation = hn::Set(d, static_cast<float>(scale.saturation));
  const Vector surely = hn::Set(d, static_cast<float>((1 + kSumTolerance) * scale.saturation));
  const Vector surely_not = hn::Set(d, static_cast<float>((1 - kSumTolerance) * scale.guard));
  const Vector slope = hn::Set(d, static_cast<float>(scale.guard_slope));
  const Vector void_value = hn::Set(d, static_cast<float>(scale.VoidValue()));
  for (int j = 0; j < kTileSize; ++j) {
    std::uint32_t inside_row = 0, outside_row = 0;
    for (int i = 0; i < kTileSize; i += kLanes) {
      const Vector f = hn::Mul(hn::Set(d, weight), hn::LoadU(d, values + j * kTileSize + i));
      const auto inside = hn::Gt(f, surely);
      const auto outside = hn::Le(f, surely_not);
      const auto bits = [&](auto mask) {
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, mask, bytes);
        return std::uint32_t{bytes[0]} << i;
      };
      inside_row |= bits(inside);
      outside_row |= bits(outside);
      const Vector branch = hn::IfThenElse(inside, saturation, guard);
      const Vector value = hn::Mul(hn::Sub(branch, f), slope);
      hn::StoreU(hn::IfThenElse(hn::Eq(f, hn::Zero(d)), void_value, value), d,
                 values + j * kTileSize + i);
    }
    sure_inside[j] = inside_row;
    sure_outside[j] = outside_row;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ScatterNearKernels);
HWY_EXPORT(ScatterNearMoments);
HWY_EXPORT(ClassifyNodes);

void ScatterNearKernels(const NearEntries& near, const float* weight, float radius,
                        NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearKernels)(near, weight, radius, sums);
}

void ScatterNearMoments(const NearEntries& near, const float* weight, float radius,
                        MomentSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearMoments)(near, weight, radius, sums);
}

void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& sure_inside,
                   BitRows& sure_outside) {
  HWY_DYNAMIC_DISPATCH(ClassifyNodes)(weight, scale, values, sure_inside, sure_outside);
}

}  // namespace partiemc
#endif  // HWY_ONCE
