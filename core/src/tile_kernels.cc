#include "tile_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tile_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row of a kernel of three spacings is six nodes: more than eight lanes would idle.
using Lanes = hn::CappedTag<float, 8>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

// The first node after `coordinate`. Truncation rounds down: no particle in or next to a tile is
// farther from it than a tile's width, and no kernel reaches farther than that from a particle.
HWY_INLINE int NodeAfter(float coordinate) {
  constexpr int kOffset = 2 * kTileSize;
  return static_cast<int>(coordinate + kOffset) - kOffset + 1;
}

// The nodes of a row or column of the tile that a kernel reaches: none if last < first.
struct NodeRange {
  int first, last;  // Inclusive.
};

HWY_INLINE NodeRange NodesReached(float centre, float radius) {
  return {std::max(NodeAfter(centre - radius), 0),
          std::min(NodeAfter(centre + radius) - 1, kTileSize - 1)};
}

// The kernel of one particle is a function of row term - column term: k = max(0, that)^3 with
// 1 - dy^2 / R^2 and dx^2 / R^2.
using RowTerms = std::array<float, kTileSize>;

HWY_INLINE void SetRowTerms(float y, NodeRange rows, float inverse_square, RowTerms& terms) {
  const Lanes d;
  const Vector from_first = hn::Set(d, y - static_cast<float>(rows.first));
  for (int row = 0; row <= rows.last - rows.first; row += kLanes) {
    const Vector dy =
        hn::Sub(from_first, hn::Add(hn::Set(d, static_cast<float>(row)), hn::Iota(d, 0.0f)));
    hn::StoreU(hn::Sub(hn::Set(d, 1.0f), hn::Mul(hn::Mul(dy, dy), hn::Set(d, inverse_square))), d,
               terms.data() + row);
  }
}

// The vector of columns that begins at `column`.
struct ColumnTerms {
  Vector dx;
  Vector term;  // Beyond the last column more than any row term, on every target alike: k = 0.
};

HWY_INLINE ColumnTerms ColumnTermsAt(float x, int column, int last, float inverse_square) {
  const Lanes d;
  const Vector lane = hn::Iota(d, 0.0f);
  const Vector dx = hn::Sub(hn::Set(d, x - static_cast<float>(column)), lane);
  const auto reached = hn::Le(lane, hn::Set(d, static_cast<float>(last - column)));
  return {dx, hn::IfThenElse(reached, hn::Mul(hn::Mul(dx, dx), hn::Set(d, inverse_square)),
                             hn::Set(d, 2.0f))};
}

HWY_INLINE Vector KernelAt(float row_term, Vector column_term) {
  const Lanes d;
  const Vector t = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, row_term), column_term));
  return hn::Mul(hn::Mul(t, t), t);
}

HWY_INLINE void AddTo(float* HWY_RESTRICT sums, Vector term) {
  const Lanes d;
  hn::StoreU(hn::Add(hn::LoadU(d, sums), term), d, sums);
}

template <bool kWeighted>
HWY_INLINE void AddRow(float row_term, Vector column_term, float weight, float* HWY_RESTRICT sums) {
  Vector k = KernelAt(row_term, column_term);
  if constexpr (kWeighted) k = hn::Mul(k, hn::Set(Lanes(), weight));
  AddTo(sums, k);
}

// Adds the rows of a kernel from `at` on: with vectors of sixteen two at a time, which takes the
// same steps for each node.
template <bool kWeighted>
HWY_INLINE void AddRows(const RowTerms& row_terms, int count, Vector column_term, float weight,
                        float* HWY_RESTRICT at) {
  int row = 0;
#if HWY_TARGET <= HWY_AVX3
  const hn::CappedTag<float, 2 * kLanes> d;
  const Lanes d_row;
  const auto column_terms = hn::Combine(d, column_term, column_term);
  for (; row + 2 <= count; row += 2) {
    const auto terms =
        hn::Combine(d, hn::Set(d_row, row_terms[row + 1]), hn::Set(d_row, row_terms[row]));
    const auto t = hn::Max(hn::Zero(d), hn::Sub(terms, column_terms));
    auto k = hn::Mul(hn::Mul(t, t), t);
    if constexpr (kWeighted) k = hn::Mul(k, hn::Set(d, weight));
    AddTo(at + row * kSumColumns, hn::LowerHalf(k));
    AddTo(at + (row + 1) * kSumColumns, hn::UpperHalf(d_row, k));
  }
#endif
  for (; row < count; ++row) {
    AddRow<kWeighted>(row_terms[row], column_term, weight, at + row * kSumColumns);
  }
}

// Kernels that the margin has room for: every one covers the same number of rows and columns, so
// that no branch depends on where a particle lies.
template <bool kWeighted>
void ScatterKernelsOf(const TileEntries& entries, float radius, NodeSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  const int span = static_cast<int>(std::ceil(2 * radius));
  alignas(64) RowTerms row_terms;
  const BinEntry* const end = entries.entries + entries.count;
  const float* next_weight = entries.weight;
  for (const BinEntry* entry = entries.entries; entry != end; ++entry) {
    const float x = entry->x;
    const float y = entry->y;
    const float weight = kWeighted ? *next_weight++ : 1.0f;
    const int column = NodeAfter(x - radius);
    const int row = NodeAfter(y - radius);
    SetRowTerms(y, {row, row + span - 1}, inverse_square, row_terms);
    for (int v = 0; v < span; v += kLanes) {
      const Vector column_term =
          ColumnTermsAt(x, column + v, column + span - 1, inverse_square).term;
      AddRows<kWeighted>(row_terms, span, column_term, weight,
                         sums.data() + SumIndex(column + v, row));
    }
  }
}

void ScatterKernels(const TileEntries& entries, float radius, NodeSums& sums) {
  entries.weight != nullptr ? ScatterKernelsOf<true>(entries, radius, sums)
                            : ScatterKernelsOf<false>(entries, radius, sums);
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

HWY_EXPORT(ScatterKernels);
HWY_EXPORT(ScatterNearKernels);
HWY_EXPORT(ScatterNearMoments);
HWY_EXPORT(ClassifyNodes);

void ScatterKernels(const TileEntries& entries, float radius, NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterKernels)(entries, radius, sums);
}

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
