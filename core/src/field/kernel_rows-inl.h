// The vectors in which kernels are added to the nodes of a tile, row by row. Compiled once for each
// target, hence the guard that each of them turns.
#if defined(PARTIEMC_KERNEL_ROWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_KERNEL_ROWS_INL_H
#undef PARTIEMC_KERNEL_ROWS_INL_H
#else
#define PARTIEMC_KERNEL_ROWS_INL_H
#endif

#include <hwy/highway.h>

#include <array>

#include "bins/lattice.h"

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

// The same of many coordinates at once.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> NodesAfter(D d, hn::Vec<D> coordinates) {
  constexpr int kOffset = 2 * kTileSize;
  const hn::RebindToSigned<D> d_int;
  const auto shifted = hn::Add(coordinates, hn::Set(d, static_cast<float>(kOffset)));
  return hn::Add(hn::ConvertTo(d_int, shifted), hn::Set(d_int, 1 - kOffset));
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

HWY_INLINE Vector KernelAt(Vector row_term, Vector column_term) {
  const Vector t = hn::Max(hn::Zero(Lanes()), hn::Sub(row_term, column_term));
  return hn::Mul(hn::Mul(t, t), t);
}

HWY_INLINE void AddTo(float* HWY_RESTRICT sums, Vector term) {
  const Lanes d;
  hn::StoreU(hn::Add(hn::LoadU(d, sums), term), d, sums);
}

template <bool kWeighted>
HWY_INLINE void AddRow(Vector row_term, Vector column_term, float weight,
                       float* HWY_RESTRICT sums) {
  Vector k = KernelAt(row_term, column_term);
  if constexpr (kWeighted) k = hn::Mul(k, hn::Set(Lanes(), weight));
  AddTo(sums, k);
}

// Calls visit(column, row, terms of the columns from there, dy, term of the row) for each vector of
// these nodes of a kernel.
template <typename Visit>
HWY_INLINE void ForEachVector(float x, float y, NodeRange columns, NodeRange rows,
                              float inverse_square, Visit visit) {
  const Lanes d;
  const Vector one = hn::Set(d, 1.0f);
  const Vector first_dy = hn::Set(d, y - static_cast<float>(rows.first));
  for (int column = columns.first; column <= columns.last; column += kLanes) {
    const ColumnTerms terms = ColumnTermsAt(x, column, columns.last, inverse_square);
    Vector dy = first_dy;
    for (int row = rows.first; row <= rows.last; ++row) {
      const Vector row_term = hn::Sub(one, hn::Mul(hn::Mul(dy, dy), hn::Set(d, inverse_square)));
      visit(column, row, terms, dy, row_term);
      dy = hn::Sub(dy, one);  // Exact, as positions in tiles are.
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
