#include "bucket_grid.h"

#include <bit>
#include <cstddef>

#include "lattice.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bucket_grid.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// As BucketGrid::Along, entry by entry. `all` is how many columns and rows the grid has.
void FindBuckets(double margin, double per_cell, int all, const BucketBox& box,
                 const NearEntries& near, std::int32_t* buckets) {
  const hn::CappedTag<double, NearEntries::kPadding / 2> d;
  const hn::Rebind<float, decltype(d)> d_float;
  const hn::Rebind<std::int32_t, decltype(d)> d_int;
  const auto step = static_cast<int>(hn::Lanes(d));
  // Lanes behind the last entry hold anything, even what no integer can: they count as 0.
  const auto along = [&](const float* coordinates, std::size_t count) HWY_ATTR {
    const auto is_entry = hn::FirstN(d_float, count);
    const auto coordinate = hn::IfThenElseZero(is_entry, hn::LoadU(d_float, coordinates));
    const auto from_margin = hn::Add(hn::PromoteTo(d, coordinate), hn::Set(d, margin));
    const auto index = hn::DemoteTo(d_int, hn::Mul(from_margin, hn::Set(d, per_cell)));
    return hn::Min(hn::Max(index, hn::Zero(d_int)), hn::Set(d_int, all - 1));
  };
  for (int k = 0; k < near.count; k += step) {
    const auto rest = static_cast<std::size_t>(near.count - k);
    const auto row = hn::Sub(along(near.y.data() + k, rest), hn::Set(d_int, box.row));
    const auto column = hn::Sub(along(near.x.data() + k, rest), hn::Set(d_int, box.column));
    hn::StoreU(hn::Add(hn::Mul(row, hn::Set(d_int, box.columns)), column), d_int, buckets + k);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {
namespace {

HWY_EXPORT(FindBuckets);

// Wide kernels get wider buckets: a query then still looks at about ten rows of them.
constexpr double kBucketsPerRadius = 4;

}  // namespace

BucketGrid::BucketGrid(double radius)
    : margin_(radius),
      per_cell_(std::min(1.0, kBucketsPerRadius / radius)),
      columns_(static_cast<int>((kTileSize + 2 * radius) * per_cell_) + 1) {}

BucketBox BucketGrid::Around(const CellMask& mask) const {
  std::uint64_t columns = 0;
  int first_row = static_cast<int>(mask.size()), last_row = 0;
  for (int row = 0; row < static_cast<int>(mask.size()); ++row) {
    if (mask[row] == 0) continue;
    columns |= mask[row];
    first_row = std::min(first_row, row);
    last_row = row;
  }
  // Bits and rows begin kMaskMargin cells before the tile.
  const auto first_of = [this](int cell) { return Along(cell - kMaskMargin); };
  const auto last_of = [this](int cell) { return Along(cell + 1 - kMaskMargin - kStep); };
  const BucketBox box{.column = first_of(std::countr_zero(columns)), .row = first_of(first_row)};
  return {.column = box.column,
          .row = box.row,
          .columns = last_of(63 - std::countl_zero(columns)) - box.column + 1,
          .rows = last_of(last_row) - box.row + 1};
}

void BucketGrid::Find(const NearEntries& near, const BucketBox& box, Buckets& buckets) const {
  HWY_DYNAMIC_DISPATCH(FindBuckets)(margin_, per_cell_, columns_, box, near, buckets.data());
}

}  // namespace partiemc
#endif  // HWY_ONCE
