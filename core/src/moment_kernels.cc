#include <algorithm>
#include <array>
#include <cmath>

#include "cell_mask.h"
#include "tile_kernels.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "moment_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "compressor-inl.h"
#include "kernel_rows-inl.h"
#include "row_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

using Integers = hn::CappedTag<std::int32_t, NearEntries::kPadding>;

// Where kernels begin, and the rows in which they reach asked nodes. Those of as many rows follow
// each other in `order`, so that the ends of loops over rows need not be guessed.
struct ReachingKernels {
  alignas(64) NearEntries::PerEntry<std::int32_t> column, row, row_count;
  NearEntries::PerEntry<std::int32_t> order;
  std::array<int, kTileSize + 1> end;  // By number of rows: where they end in `order`.
};

// The place of the highest bit, if the one below it is not set: else a conversion might round up.
HWY_INLINE hn::Vec<Integers> PlaceOfHighest(hn::Vec<Integers> bits) {
  const Integers d;
  const auto as_float = hn::BitCast(d, hn::ConvertTo(hn::RebindToFloat<Integers>(), bits));
  const auto exponent = hn::Sub(hn::ShiftRight<23>(as_float), hn::Set(d, 127));
  return hn::IfThenElse(hn::Lt(bits, hn::Zero(d)), hn::Set(d, kTileSize - 1), exponent);
}

// How many rows there are from the first one to the last one, and which is the first.
struct RowSpan {
  hn::Vec<Integers> first, count;
};
HWY_INLINE RowSpan SpanOf(hn::Vec<Integers> rows) {
  const Integers d;
  const auto half =
      hn::BitCast(d, hn::ShiftRight<1>(hn::BitCast(hn::RebindToUnsigned<Integers>(), rows)));
  const auto first = PlaceOfHighest(hn::And(rows, hn::Neg(rows)));
  const auto last = PlaceOfHighest(hn::AndNot(half, rows));
  const auto count = hn::Sub(last, hn::Sub(first, hn::Set(d, 1)));
  return {first, hn::IfThenZeroElse(hn::Eq(rows, hn::Zero(d)), count)};
}

// Bits of the rows of a tile that kernels reach which begin at `first`. Those that begin farther
// before the tile than its height, as only wide ones do, are listed as if they began there: what
// they add beyond their reach is 0.
HWY_INLINE hn::Vec<Integers> RowsFrom(hn::Vec<Integers> first, int span) {
  const Integers d;
  const auto row = hn::Max(first, hn::Set(d, 1 - kTileSize));
  const hn::RebindToUnsigned<Integers> d_bits;
  const auto all = hn::Set(d_bits, ~std::uint32_t{0});
  const auto in_tile = [&](hn::Vec<Integers> count) HWY_ATTR {
    return hn::BitCast(d_bits, hn::Min(hn::Max(count, hn::Zero(d)), hn::Set(d, kTileSize - 1)));
  };
  const auto before = in_tile(row), behind = in_tile(hn::Sub(hn::Set(d, kTileSize - span), row));
  const auto rows = hn::And(hn::Shl(all, before), hn::Shr(all, behind));
  // None beyond the tile.
  const auto is_near = hn::And(hn::Lt(row, hn::Set(d, kTileSize)), hn::Gt(row, hn::Set(d, -span)));
  return hn::IfThenElseZero(is_near, hn::BitCast(d, rows));
}

void FindReaching(const NearEntries& near, float radius, const AskedColumns& asked,
                  ReachingKernels& kernels) {
  const hn::RebindToFloat<Integers> d;
  const Integers d_int;
  const auto step = static_cast<int>(hn::Lanes(d));
  const RowTable asked_rows(asked.rows);
  const auto last_column = hn::Set(d_int, kTileSize - 1);
  for (int e = 0; e < near.count; e += step) {
    // Lanes behind the last entry hold anything, even what no integer can: they count as 0.
    const auto is_entry = hn::FirstN(d, static_cast<std::size_t>(near.count - e));
    const auto first = [&](const float* centres) HWY_ATTR {
      const auto centre = hn::IfThenElseZero(is_entry, hn::LoadU(d, centres + e));
      return NodesAfter(d, hn::Sub(centre, hn::Set(d, radius)));
    };
    const auto column = first(near.x.data());
    hn::Store(column, d_int, kernels.column.data() + e);
    const auto asked_there = asked_rows[hn::Min(hn::Max(column, hn::Zero(d_int)), last_column)];
    const auto rows = hn::And(asked_there, RowsFrom(first(near.y.data()), asked.span));
    const auto counts = hn::AndNot(hn::VecFromMask(d_int, hn::Gt(column, last_column)), rows);
    const RowSpan reached = SpanOf(hn::IfThenElseZero(hn::RebindMask(d_int, is_entry), counts));
    hn::Store(reached.first, d_int, kernels.row.data() + e);
    hn::Store(reached.count, d_int, kernels.row_count.data() + e);
  }
  const auto lane = hn::Iota(d_int, 0);
  int listed = 0;
  for (int count = 1; count <= asked.MaxRows(); ++count) {
    for (int e = 0; e < near.count; e += step) {
      const auto counts = hn::Load(d_int, kernels.row_count.data() + e);
      const auto is_of = hn::Eq(counts, hn::Set(d_int, count));
      const Compressor compress(is_of);
      hn::StoreU(compress(d_int, hn::Add(lane, hn::Set(d_int, e))), d_int,
                 kernels.order.data() + listed);
      listed += static_cast<int>(hn::CountTrue(d_int, is_of));
    }
    kernels.end[count] = listed;
  }
}

template <bool kKernel>
void ScatterNearMomentsOf(const NearEntries& near, float radius, const AskedColumns& asked,
                          MomentSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  ReachingKernels kernels;
  FindReaching(near, radius, asked, kernels);
  int n = 0;
  for (int count = 1; count <= asked.MaxRows(); ++count) {
    for (; n < kernels.end[count]; ++n) {
      const int e = kernels.order[n];
      const NodeRange columns = {std::max(kernels.column[e], 0),
                                 std::min(kernels.column[e] + asked.span, kTileSize) - 1};
      const NodeRange rows = {kernels.row[e], kernels.row[e] + count - 1};
      ForEachVector(near.x[e], near.y[e], columns, rows, inverse_square,
                    [&](int column, int row, const ColumnTerms& terms, Vector dy, Vector row_term)
                        HWY_ATTR {
                          const Vector k = KernelAt(row_term, terms.term);
                          const int at = SumIndex(column, row);
                          if constexpr (kKernel) AddTo(sums.kernel.data() + at, k);
                          const Vector kx = hn::Mul(k, terms.dx);
                          const Vector ky = hn::Mul(k, dy);
                          AddTo(sums.moment_x.data() + at, kx);
                          AddTo(sums.moment_y.data() + at, ky);
                          AddTo(sums.xx.data() + at, hn::Mul(kx, terms.dx));
                          AddTo(sums.xy.data() + at, hn::Mul(kx, dy));
                          AddTo(sums.yy.data() + at, hn::Mul(ky, dy));
                        });
    }
  }
}

void ScatterNearMoments(const NearEntries& near, float radius, const AskedColumns& asked,
                        bool has_kernel_sums, MomentSums& sums) {
  has_kernel_sums ? ScatterNearMomentsOf<false>(near, radius, asked, sums)
                  : ScatterNearMomentsOf<true>(near, radius, asked, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ScatterNearMoments);

void ScatterNearMoments(const NearEntries& near, float radius, const AskedColumns& asked,
                        bool has_kernel_sums, MomentSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearMoments)(near, radius, asked, has_kernel_sums, sums);
}

AskedColumns ColumnsOf(const AskedNodes& asked, float radius) {
  const int span = static_cast<int>(std::ceil(2 * radius));
  // In place of each node all columns from which a kernel reaches it.
  BitRows within = asked.rows;
  const int width = std::min(span, kTileSize);
  for (int reached = 1; reached < width;) {
    const int step = std::min(reached, width - reached);
    for (std::uint32_t& row : within) row |= row >> step;
    reached += step;
  }
  return {Transposed(within), span};
}

void ClearMoments(const AskedNodes& asked, MomentSums& sums) {
  int first = 0, last = kTileSize - 1;
  while (asked.rows[first] == 0) ++first;
  while (asked.rows[last] == 0) --last;
  const auto clear = [&](NodeSums& channel) {
    // Vectors that begin in the tile end before its next row does.
    std::fill(channel.begin() + SumIndex(0, first), channel.begin() + SumIndex(0, last + 1), 0.0f);
  };
  if (!asked.has_kernel_sums) clear(sums.kernel);
  for (NodeSums* const channel : {&sums.moment_x, &sums.moment_y, &sums.xx, &sums.xy, &sums.yy}) {
    clear(*channel);
  }
}

}  // namespace partiemc
#endif  // HWY_ONCE
