#include "bucket_grid.h"

#include "coordinate_block.h"
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

// As BucketGrid::Along, entry by entry.
void FindBuckets(double margin, double per_cell, int columns, const NearEntries& near,
                 std::int32_t* buckets) {
  const hn::CappedTag<double, NearEntries::kPadding / 2> d;
  const hn::Rebind<float, decltype(d)> d_float;
  const hn::Rebind<std::int32_t, decltype(d)> d_int;
  const auto step = static_cast<int>(hn::Lanes(d));
  const auto along = [&](const float* coordinates) HWY_ATTR {
    const auto from_margin =
        hn::Add(hn::PromoteTo(d, hn::LoadU(d_float, coordinates)), hn::Set(d, margin));
    const auto index = hn::DemoteTo(d_int, hn::Mul(from_margin, hn::Set(d, per_cell)));
    return hn::Min(hn::Max(index, hn::Zero(d_int)), hn::Set(d_int, columns - 1));
  };
  for (int k = 0; k < near.count; k += step) {
    const auto row = along(near.y.data() + k);
    const auto column = along(near.x.data() + k);
    hn::StoreU(hn::Add(hn::Mul(row, hn::Set(d_int, columns)), column), d_int, buckets + k);
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

bool BucketGrid::KeepsTilesApart() const {
  // On either side of a tile's side, particles are a step of their positions apart at least.
  const double step = 1.0 / (1 << kFractionBits);
  const auto parts = [&](double side) { return Along(side - step) < Along(side); };
  return parts(0) && parts(kTileSize);
}

void BucketGrid::Find(const NearEntries& near, Buckets& buckets) const {
  HWY_DYNAMIC_DISPATCH(FindBuckets)(margin_, per_cell_, columns_, near, buckets.data());
}

}  // namespace partiemc
#endif  // HWY_ONCE
