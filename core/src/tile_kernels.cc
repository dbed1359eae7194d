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

// The first node after `coordinate`. Truncation rounds down: no particle of a tile's list is
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
    const Vector dy = hn::Sub(from_first, hn::Iota(d, static_cast<float>(row)));
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

// Kernels that the margin has room for: every one covers the same number of rows and columns, so
// that no branch depends on where a particle lies.
template <bool kWeighted>
void ScatterSmallKernels(const TileEntries& entries, float radius, NodeSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  const int span = static_cast<int>(std::ceil(2 * radius));
  alignas(64) RowTerms row_terms;
  for (std::size_t e = 0; e < entries.count; ++e) {
    const float x = entries.entries[e].x;
    const float y = entries.entries[e].y;
    const float weight = kWeighted ? entries.weight[e] : 1.0f;
    const int column = NodeAfter(x - radius);
    const int row = NodeAfter(y - radius);
    SetRowTerms(y, {row, row + span - 1}, inverse_square, row_terms);
    for (int v = 0; v < span; v += kLanes) {
      const Vector column_term =
          ColumnTermsAt(x, column + v, column + span - 1, inverse_square).term;
      float* HWY_RESTRICT at = sums.data() + SumIndex(column + v, row);
      for (int k = 0; k < span; ++k) {
        AddRow<kWeighted>(row_terms[k], column_term, weight, at + k * kSumColumns);
      }
    }
  }
}

template <bool kWeighted>
void ScatterKernels(const TileEntries& entries, float radius, NodeSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  alignas(64) RowTerms row_terms;
  for (std::size_t e = 0; e < entries.count; ++e) {
    const float x = entries.entries[e].x;
    const float y = entries.entries[e].y;
    const float weight = kWeighted ? entries.weight[e] : 1.0f;
    const NodeRange columns = NodesReached(x, radius);
    const NodeRange rows = NodesReached(y, radius);
    SetRowTerms(y, rows, inverse_square, row_terms);
    for (int column = columns.first; column <= columns.last; column += kLanes) {
      const Vector column_term = ColumnTermsAt(x, column, columns.last, inverse_square).term;
      for (int row = rows.first; row <= rows.last; ++row) {
        AddRow<kWeighted>(row_terms[row - rows.first], column_term, weight,
                          sums.data() + SumIndex(column, row));
      }
    }
  }
}

void ScatterKernel(const TileEntries& entries, float radius, NodeSums& sums) {
  sums.fill(0);
  const bool weighted = entries.weight != nullptr;
  if (2 * radius <= kSumMargin) {
    weighted ? ScatterSmallKernels<true>(entries, radius, sums)
             : ScatterSmallKernels<false>(entries, radius, sums);
  } else {
    weighted ? ScatterKernels<true>(entries, radius, sums)
             : ScatterKernels<false>(entries, radius, sums);
  }
}

template <bool kWeighted>
void ScatterMomentsLoop(const TileEntries& entries, float radius, const CellMask* mask,
                        MomentSums& sums) {
  const Lanes d;
  const float inverse_square = 1 / (radius * radius);
  alignas(64) RowTerms row_terms;
  for (std::size_t e = 0; e < entries.count; ++e) {
    const float x = entries.entries[e].x;
    const float y = entries.entries[e].y;
    if (mask != nullptr && !IsInMask(*mask, entries.entries[e])) continue;
    const NodeRange columns = NodesReached(x, radius);
    const NodeRange rows = NodesReached(y, radius);
    SetRowTerms(y, rows, inverse_square, row_terms);
    for (int column = columns.first; column <= columns.last; column += kLanes) {
      const ColumnTerms terms = ColumnTermsAt(x, column, columns.last, inverse_square);
      for (int row = rows.first; row <= rows.last; ++row) {
        const Vector k = KernelAt(row_terms[row - rows.first], terms.term);
        const Vector dy = hn::Set(d, y - static_cast<float>(row));
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
          AddTo(sums.weighted.data() + at, hn::Mul(k, hn::Set(d, entries.weight[e])));
        }
      }
    }
  }
}

void ScatterMoments(const TileEntries& entries, float radius, const CellMask* mask,
                    MomentSums& sums) {
  sums.kernel.fill(0);
  sums.moment_x.fill(0);
  sums.moment_y.fill(0);
  sums.xx.fill(0);
  sums.xy.fill(0);
  sums.yy.fill(0);
  if (entries.weight != nullptr) {
    sums.weighted.fill(0);
    ScatterMomentsLoop<true>(entries, radius, mask, sums);
  } else {
    ScatterMomentsLoop<false>(entries, radius, mask, sums);
  }
}

void ClassifyNodes(const NodeSums& sums, float weight, const Scale& scale, float* values,
                   BitRows& sure_inside, BitRows& sure_outside) {
  const Lanes d;
  const Vector guard = hn::Set(d, static_cast<float>(scale.guard));
  const Vector saturation = hn::Set(d, static_cast<float>(scale.saturation));
  const Vector slope = hn::Set(d, static_cast<float>(scale.guard_slope));
  const Vector void_value = hn::Set(d, static_cast<float>(scale.VoidValue()));
  for (int j = 0; j < kTileSize; ++j) {
    std::uint32_t inside_row = 0, outside_row = 0;
    for (int i = 0; i < kTileSize; i += kLanes) {
      const Vector f = hn::Mul(hn::Set(d, weight), hn::LoadU(d, sums.data() + SumIndex(i, j)));
      const auto inside = hn::Gt(f, saturation);
      const auto outside = hn::Le(f, guard);
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

HWY_EXPORT(ScatterKernel);
HWY_EXPORT(ScatterMoments);
HWY_EXPORT(ClassifyNodes);

void ScatterKernel(const TileEntries& entries, float radius, NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterKernel)(entries, radius, sums);
}

void ScatterMoments(const TileEntries& entries, float radius, const CellMask* mask,
                    MomentSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterMoments)(entries, radius, mask, sums);
}

void ClassifyNodes(const NodeSums& sums, float weight, const Scale& scale, float* values,
                   BitRows& sure_inside, BitRows& sure_outside) {
  HWY_DYNAMIC_DISPATCH(ClassifyNodes)(sums, weight, scale, values, sure_inside, sure_outside);
}

}  // namespace partiemc
#endif  // HWY_ONCE
