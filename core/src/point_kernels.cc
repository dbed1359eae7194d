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
template <typename Vector>
struct Terms {
  Vector dx, dy, kernel, slope_x, slope_y;
};

// Each adds to the channels of one partial sum; `Points` is OnePoint or TwoPoints.
template <bool kWeighted>
struct AddSums {
  static constexpr int kChannels = kWeighted ? int{kWeightedSums} : int{kSums};

  template <typename Points, typename Vector>
  HWY_INLINE void operator()(const Points& points, const float* weight, const Terms<Vector>& terms,
                             Vector* sums) const {
    const auto& [dx, dy, k, kx, ky] = terms;
    const auto add = [&](int channel, Vector term)
                         HWY_ATTR { sums[channel] = hn::Add(sums[channel], term); };
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
      const Vector w = points.Load(weight);
      add(kDensity, hn::Mul(w, k));
      add(kDensityX, hn::Mul(w, kx));
      add(kDensityY, hn::Mul(w, ky));
    }
  }
};

struct AddThirdSums {
  static constexpr int kChannels = kThirdSums;

  template <typename Points, typename Vector>
  HWY_INLINE void operator()(const Points&, const float*, const Terms<Vector>& terms,
                             Vector* sums) const {
    const auto& [dx, dy, k, kx, ky] = terms;
    const auto add = [&](int channel, Vector term)
                         HWY_ATTR { sums[channel] = hn::Add(sums[channel], term); };
    const Vector xx = hn::Mul(kx, dx);
    const Vector yy = hn::Mul(ky, dy);
    add(kXxx, hn::Mul(xx, dx));
    add(kXxy, hn::Mul(hn::Mul(kx, dy), dx));
    add(kXyy, hn::Mul(yy, dx));
    add(kYyy, hn::Mul(yy, dy));
  }
};

// Sums over the entries of `points`, all in the arrays of `entries`: totals[p] are those of point
// p.
template <typename Points, typename Add>
HWY_INLINE void Sum(const PointQuery& entries, Points points, Add add,
                    double (&totals)[Points::kPoints][Add::kChannels]) {
  using D = typename Points::D;
  using Vector = typename Points::Vector;
  constexpr int kParts = Points::kParts;
  const D d;
  Vector sums[kParts][Add::kChannels];
  for (auto& part : sums) {
    for (Vector& sum : part) sum = hn::Zero(d);
  }
  const Vector x = points.PerPoint([](const PointQuery& query) { return query.x; });
  const Vector y = points.PerPoint([](const PointQuery& query) { return query.y; });
  const Vector inverse_square = hn::Set(d, entries.inverse_square);
  points.ForEachVector([&](int part) HWY_ATTR {
    const Vector dx = hn::Sub(points.Load(entries.entry_x), x);
    const Vector dy = hn::Sub(points.Load(entries.entry_y), y);
    const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    Vector t = hn::Sub(hn::Set(d, 1.0), hn::Mul(square, inverse_square));
    t = hn::IfThenElseZero(points.IsEntry(), hn::Max(hn::Zero(d), t));
    const Vector t2 = hn::Mul(t, t);
    const Vector slope = hn::Mul(hn::Mul(hn::Set(d, 6.0), t2), inverse_square);
    add(points, entries.weight,
        Terms<Vector>{dx, dy, hn::Mul(t2, t), hn::Mul(slope, dx), hn::Mul(slope, dy)}, sums[part]);
  });
  for (int channel = 0; channel < Add::kChannels; channel += 2) {
    const bool has_next = channel + 1 < Add::kChannels;
    Vector first[kParts], second[kParts];
    for (int part = 0; part < kParts; ++part) {
      first[part] = sums[part][channel];
      second[part] = has_next ? sums[part][channel + 1] : hn::Zero(d);
    }
    HWY_ALIGN double both[Points::kPoints * kPointPadding];
    StoreTotals(d, first, second, both);
    for (int point = 0; point < Points::kPoints; ++point) {
      totals[point][channel] = both[point * kPointPadding];
      if (has_next) totals[point][channel + 1] = both[point * kPointPadding + 1];
    }
  }
}

template <bool kWeighted>
PointSums Named(const PointQuery& query, const double* totals) {
  const auto weighted = [&](WeightedChannel channel, Channel plain) {
    return kWeighted ? totals[channel] : query.uniform_weight * totals[plain];
  };
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
          .density = weighted(kDensity, kKernel),
          .density_x = weighted(kDensityX, kSlopeX),
          .density_y = weighted(kDensityY, kSlopeY)};
}

template <bool kWeighted>
PointSums SumOne(const PointQuery& query) {
  double totals[1][AddSums<kWeighted>::kChannels];
  Sum(query, OnePoint(query), AddSums<kWeighted>(), totals);
  return Named<kWeighted>(query, totals[0]);
}

template <bool kWeighted>
std::array<PointSums, 2> SumTwo(const PointQuery& first, const PointQuery& second) {
#if PARTIEMC_TWO_POINTS_FIT
  double totals[2][AddSums<kWeighted>::kChannels];
  Sum(first, TwoPoints(first, second), AddSums<kWeighted>(), totals);
  return {Named<kWeighted>(first, totals[0]), Named<kWeighted>(second, totals[1])};
#else
  return {SumOne<kWeighted>(first), SumOne<kWeighted>(second)};
#endif
}

PointSums SumAtPoint(const PointQuery& query) {
  return query.weight != nullptr ? SumOne<true>(query) : SumOne<false>(query);
}

std::array<PointSums, 2> SumAtTwoPoints(const PointQuery& first, const PointQuery& second) {
  return first.weight != nullptr ? SumTwo<true>(first, second) : SumTwo<false>(first, second);
}

PointThirdSums ThirdSumsAtPoint(const PointQuery& query) {
  double totals[1][kThirdSums];
  Sum(query, OnePoint(query), AddThirdSums(), totals);
  const double* const sums = totals[0];
  return {.xxx = sums[kXxx], .xxy = sums[kXxy], .xyy = sums[kXyy], .yyy = sums[kYyy]};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumAtPoint);
HWY_EXPORT(SumAtTwoPoints);
HWY_EXPORT(ThirdSumsAtPoint);

PointSums SumAtPoint(const PointQuery& query) { return HWY_DYNAMIC_DISPATCH(SumAtPoint)(query); }

std::array<PointSums, 2> SumAtTwoPoints(const PointQuery& first, const PointQuery& second) {
  return HWY_DYNAMIC_DISPATCH(SumAtTwoPoints)(first, second);
}

PointThirdSums ThirdSumsAtPoint(const PointQuery& query) {
  return HWY_DYNAMIC_DISPATCH(ThirdSumsAtPoint)(query);
}

}  // namespace partiemc
#endif  // HWY_ONCE
