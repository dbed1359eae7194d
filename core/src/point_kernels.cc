#include "point_kernels.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "point_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "point_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// sum w k etc. follow from the others where all weights are the same.
enum Channel {
  kKernel,
  kMomentX,
  kMomentY,
  kSlopeX,
  kSlopeY,
  kKxx,
  kKxy,
  kKyy,
  kXx,
  kXy,
  kYy,
  kSums
};
enum WeightedChannel { kDensity = kSums, kDensityX, kDensityY, kWeightedSums };
enum ThirdChannel { kXxx, kXxy, kXyy, kYyy, kThirdSums };

// What particles contribute: d, k and dk / da, 0 beyond the row and beyond the kernel.
struct Terms {
  Vector dx, dy, kernel, slope_x, slope_y;
};

HWY_INLINE Terms TermsOf(const PointQuery& query, std::uint32_t entry, int left) {
  const Lanes d;
  const Vector dx = hn::Sub(LoadDouble(query.entry_x + entry), hn::Set(d, query.x));
  const Vector dy = hn::Sub(LoadDouble(query.entry_y + entry), hn::Set(d, query.y));
  const Vector inverse_square = hn::Set(d, query.inverse_square);
  const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
  Vector t = hn::Sub(hn::Set(d, 1.0), hn::Mul(square, inverse_square));
  // Lanes past the end of the row hold other entries, or none.
  const auto is_entry = hn::Lt(hn::Iota(d, 0.0), hn::Set(d, static_cast<double>(left)));
  t = hn::IfThenElseZero(is_entry, hn::Max(hn::Zero(d), t));
  const Vector t2 = hn::Mul(t, t);
  const Vector slope = hn::Mul(hn::Mul(hn::Set(d, 6.0), t2), inverse_square);
  return {dx, dy, hn::Mul(t2, t), hn::Mul(slope, dx), hn::Mul(slope, dy)};
}

// Each adds to the channels of one partial sum.
template <bool kWeighted>
struct AddSums {
  static constexpr int kChannels = kWeighted ? int{kWeightedSums} : int{kSums};

  HWY_INLINE void operator()(const PointQuery& query, std::uint32_t entry, const Terms& terms,
                             Vector* sums) const {
    const auto& [dx, dy, k, kx, ky] = terms;
    const auto add = [&](int channel, Vector term) {
      sums[channel] = hn::Add(sums[channel], term);
    };
    add(kKernel, k);
    const Vector moment_x = hn::Mul(k, dx);
    const Vector moment_y = hn::Mul(k, dy);
    add(kMomentX, moment_x);
    add(kMomentY, moment_y);
    add(kSlopeX, kx);
    add(kSlopeY, ky);
    add(kKxx, hn::Mul(moment_x, dx));
    add(kKxy, hn::Mul(moment_x, dy));
    add(kKyy, hn::Mul(moment_y, dy));
    add(kXx, hn::Mul(kx, dx));
    add(kXy, hn::Mul(kx, dy));
    add(kYy, hn::Mul(ky, dy));
    if constexpr (kWeighted) {
      const Vector w = LoadDouble(query.weight + entry);
      add(kDensity, hn::Mul(w, k));
      add(kDensityX, hn::Mul(w, kx));
      add(kDensityY, hn::Mul(w, ky));
    }
  }
};

struct AddThirdSums {
  static constexpr int kChannels = kThirdSums;

  HWY_INLINE void operator()(const PointQuery&, std::uint32_t, const Terms& terms,
                             Vector* sums) const {
    const auto& [dx, dy, k, kx, ky] = terms;
    const auto add = [&](int channel, Vector term) {
      sums[channel] = hn::Add(sums[channel], term);
    };
    const Vector xx = hn::Mul(kx, dx);
    const Vector yy = hn::Mul(ky, dy);
    add(kXxx, hn::Mul(xx, dx));
    add(kXxy, hn::Mul(hn::Mul(kx, dy), dx));
    add(kXyy, hn::Mul(yy, dx));
    add(kYyy, hn::Mul(yy, dy));
  }
};

template <typename Add>
HWY_INLINE void Sum(const PointQuery& query, Add add, double* totals) {
  const Lanes d;
  Vector sums[kParts][Add::kChannels];
  for (auto& part : sums) {
    for (Vector& sum : part) sum = hn::Zero(d);
  }
  for (int row = 0; row < query.rows; ++row) {
    const std::uint32_t* offsets = query.offsets + row * query.row_stride;
    const std::uint32_t end = offsets[query.columns];
    for (std::uint32_t entry = offsets[0]; entry < end; entry += kPointPadding) {
      for (int part = 0; part < kParts; ++part) {
        const int left = static_cast<int>(end - entry) - part * kLanes;
        const std::uint32_t first = entry + part * kLanes;
        add(query, first, TermsOf(query, first, left), sums[part]);
      }
    }
  }
  for (int channel = 0; channel < Add::kChannels; ++channel) {
    HWY_ALIGN double parts[kPointPadding];
    for (int part = 0; part < kParts; ++part) {
      hn::StoreU(sums[part][channel], d, parts + part * kLanes);
    }
    totals[channel] = (parts[0] + parts[1]) + (parts[2] + parts[3]);
  }
}

PointSums SumAtPoint(const PointQuery& query) {
  double totals[kWeightedSums];
  if (query.weight != nullptr) {
    Sum(query, AddSums<true>(), totals);
  } else {
    Sum(query, AddSums<false>(), totals);
    totals[kDensity] = query.uniform_weight * totals[kKernel];
    totals[kDensityX] = query.uniform_weight * totals[kSlopeX];
    totals[kDensityY] = query.uniform_weight * totals[kSlopeY];
  }
  return {.kernel = totals[kKernel],
          .moment_x = totals[kMomentX],
          .moment_y = totals[kMomentY],
          .slope_x = totals[kSlopeX],
          .slope_y = totals[kSlopeY],
          .kxx = totals[kKxx],
          .kxy = totals[kKxy],
          .kyy = totals[kKyy],
          .xx = totals[kXx],
          .xy = totals[kXy],
          .yy = totals[kYy],
          .density = totals[kDensity],
          .density_x = totals[kDensityX],
          .density_y = totals[kDensityY]};
}

PointThirdSums ThirdSumsAtPoint(const PointQuery& query) {
  double totals[kThirdSums];
  Sum(query, AddThirdSums(), totals);
  return {.xxx = totals[kXxx], .xxy = totals[kXxy], .xyy = totals[kXyy], .yyy = totals[kYyy]};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumAtPoint);
HWY_EXPORT(ThirdSumsAtPoint);

PointSums SumAtPoint(const PointQuery& query) { return HWY_DYNAMIC_DISPATCH(SumAtPoint)(query); }

PointThirdSums ThirdSumsAtPoint(const PointQuery& query) {
  return HWY_DYNAMIC_DISPATCH(ThirdSumsAtPoint)(query);
}

}  // namespace partiemc
#endif  // HWY_ONCE
