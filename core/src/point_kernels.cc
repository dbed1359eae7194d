#include "point_kernels.h"

#include <cstddef>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "point_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "near_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// With t = 1 - d^2 / R^2: k = t^3 and dk / da = 6 t^2 d_a / R^2, whose factor comes last. Sums over
// w k etc. follow from the others where all weights are the same.
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

// What particles contribute: d, t and t^2; t is 0 beyond the kernel.
struct Terms {
  Vector dx, dy, t, t2;
};

template <int kChannels>
HWY_INLINE void Add(Vector (&sums)[kChannels], int channel, Vector term) {
  sums[channel] = hn::Add(sums[channel], term);
}

template <bool kWeighted>
struct AddSums {
  static constexpr int kChannels = kWeighted ? int{kWeightedSums} : int{kSums};

  HWY_INLINE void operator()([[maybe_unused]] const float* weight, const Terms& terms,
                             Vector (&sums)[kChannels]) const {
    const auto& [dx, dy, t, t2] = terms;
    const Vector k = hn::Mul(t2, t);
    Add(sums, kKernel, k);
    const Vector slope_x = hn::Mul(t2, dx);
    const Vector slope_y = hn::Mul(t2, dy);
    Add(sums, kSlopeX, slope_x);
    Add(sums, kSlopeY, slope_y);
    Add(sums, kMomentX, hn::Mul(k, dx));
    Add(sums, kMomentY, hn::Mul(k, dy));
    const Vector xx = hn::Mul(slope_x, dx);
    const Vector xy = hn::Mul(slope_x, dy);
    const Vector yy = hn::Mul(slope_y, dy);
    Add(sums, kXx, xx);
    Add(sums, kXy, xy);
    Add(sums, kYy, yy);
    Add(sums, kKxx, hn::Mul(t, xx));
    Add(sums, kKxy, hn::Mul(t, xy));
    Add(sums, kKyy, hn::Mul(t, yy));
    if constexpr (kWeighted) {
      const Vector w = hn::LoadU(Lanes(), weight);
      Add(sums, kDensity, hn::Mul(w, k));
      Add(sums, kDensityX, hn::Mul(w, slope_x));
      Add(sums, kDensityY, hn::Mul(w, slope_y));
    }
  }
};

struct AddThirdSums {
  static constexpr int kChannels = kThirdSums;

  HWY_INLINE void operator()(const float*, const Terms& terms, Vector (&sums)[kChannels]) const {
    const auto& [dx, dy, t, t2] = terms;
    const Vector xx = hn::Mul(hn::Mul(t2, dx), dx);
    const Vector yy = hn::Mul(hn::Mul(t2, dy), dy);
    Add(sums, kXxx, hn::Mul(xx, dx));
    Add(sums, kXxy, hn::Mul(xx, dy));
    Add(sums, kXyy, hn::Mul(yy, dx));
    Add(sums, kYyy, hn::Mul(yy, dy));
  }
};

// Adds a chunk's particles to the sums at a point.
template <typename AddTerms>
HWY_INLINE void SumChunk(const PointKernel& kernel, const NearRows& near, const NearChunk& chunk,
                         const LatticePoint& point, double (&totals)[AddTerms::kChannels]) {
  const Lanes d;
  const Vector x = hn::Set(d, static_cast<float>(point.x - near.origin_x));
  const Vector y = hn::Set(d, static_cast<float>(point.y - near.origin_y));
  const Vector inverse_square = hn::Set(d, static_cast<float>(kernel.inverse_square));
  PartialSums<AddTerms::kChannels> sums(
      chunk, [&](int k, Vector(&channels)[AddTerms::kChannels]) HWY_ATTR {
        const Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
        const Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
        const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        const Vector t =
            hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, inverse_square)));
        AddTerms()(chunk.weight + k, Terms{dx, dy, t, hn::Mul(t, t)}, channels);
      });
  sums.AddTo(totals);
}

template <bool kWeighted>
PointSums Named(const PointKernel& kernel, const double* totals) {
  const double slope = 6 * kernel.inverse_square;
  const double w = kernel.uniform_weight;
  return {.kernel = totals[kKernel],
          .moment_x = totals[kMomentX],
          .moment_y = totals[kMomentY],
          .slope_x = slope * totals[kSlopeX],
          .slope_y = slope * totals[kSlopeY],
          .kxx = totals[kKxx],
          .kxy = totals[kKxy],
          .kyy = totals[kKyy],
          .xx = slope * totals[kXx],
          .xy = slope * totals[kXy],
          .yy = slope * totals[kYy],
          .density = kWeighted ? totals[kDensity] : w * totals[kKernel],
          .density_x = slope * (kWeighted ? totals[kDensityX] : w * totals[kSlopeX]),
          .density_y = slope * (kWeighted ? totals[kDensityY] : w * totals[kSlopeY])};
}

template <bool kWeighted>
HWY_INLINE void Sum(const PointKernel& kernel, std::span<const PointQuery> queries,
                    std::span<QuerySums> sums) {
  double totals[kQueriesAtOnce][kPointsAtOnce][AddSums<kWeighted>::kChannels] = {};
  ForEachQuery<kWeighted>(queries, [&](std::size_t q, const NearChunk& chunk) HWY_ATTR {
    const PointQuery& query = queries[q];
    for (std::size_t k = 0; k < query.count; ++k) {
      SumChunk<AddSums<kWeighted>>(kernel, query.near, chunk, query.points[k], totals[q][k]);
    }
  });
  for (std::size_t q = 0; q < queries.size(); ++q) {
    for (std::size_t k = 0; k < queries[q].count; ++k) {
      sums[q][k] = Named<kWeighted>(kernel, totals[q][k]);
    }
  }
}

void SumAtPoints(const PointKernel& kernel, std::span<const PointQuery> queries,
                 std::span<QuerySums> sums) {
  queries.front().near.weight != nullptr ? Sum<true>(kernel, queries, sums)
                                         : Sum<false>(kernel, queries, sums);
}

PointThirdSums ThirdSumsAtPoint(const PointKernel& kernel, const NearRows& near,
                                const LatticePoint& point) {
  double totals[kThirdSums] = {};
  NearChunk room;
  ForEachChunk<false>(near, room, [&](const NearChunk& chunk) HWY_ATTR {
    SumChunk<AddThirdSums>(kernel, near, chunk, point, totals);
  });
  const double slope = 6 * kernel.inverse_square;
  return {.xxx = slope * totals[kXxx],
          .xxy = slope * totals[kXxy],
          .xyy = slope * totals[kXyy],
          .yyy = slope * totals[kYyy]};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumAtPoints);
HWY_EXPORT(ThirdSumsAtPoint);

void SumAtPoints(const PointKernel& kernel, std::span<const PointQuery> queries,
                 std::span<QuerySums> sums) {
  HWY_DYNAMIC_DISPATCH(SumAtPoints)(kernel, queries, sums);
}

PointThirdSums ThirdSumsAtPoint(const PointKernel& kernel, const NearRows& near,
                                const LatticePoint& point) {
  return HWY_DYNAMIC_DISPATCH(ThirdSumsAtPoint)(kernel, near, point);
}

}  // namespace partiemc
#endif  // HWY_ONCE
