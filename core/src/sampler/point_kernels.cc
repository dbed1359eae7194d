#include "sampler/point_kernels.h"

#include <cstddef>
#include <iterator>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sampler/point_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sampler/neighbour_sums-inl.h"
#include "sampler/point_formula-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

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

// The sums over a chunk's particles at a point.
template <typename AddTerms>
HWY_INLINE PartialSums<AddTerms::kChannels> SumChunk(double inverse_square,
                                                     const NeighbourRows& near,
                                                     const NeighbourChunk& chunk,
                                                     const Point& point) {
  const Lanes d;
  const Vector x = hn::Set(d, static_cast<float>(point.x - near.origin_x));
  const Vector y = hn::Set(d, static_cast<float>(point.y - near.origin_y));
  const Vector scale = hn::Set(d, static_cast<float>(inverse_square));
  return PartialSums<AddTerms::kChannels>(
      chunk, [&](int k, Vector(&channels)[AddTerms::kChannels]) HWY_ATTR {
        const Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
        const Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
        const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        const Vector t = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, scale)));
        AddTerms()(chunk.weight + k, Terms{dx, dy, t, hn::Mul(t, t)}, channels);
      });
}

template <bool kWeighted>
HWY_INLINE void Sample(const Scale& scale, const PointQuery& query, PointSamples& samples) {
  const double inverse_square = 1 / (scale.kernel_radius * scale.kernel_radius);
  HWY_ALIGN typename PointFormula<kWeighted>::Totals totals = {};
  ForEachChunk<kWeighted>(query.near, [&](const NeighbourChunk& chunk) HWY_ATTR {
    for (std::size_t k = 0; k < query.points.size(); ++k) {
      SumChunk<AddSums<kWeighted>>(inverse_square, query.near, chunk, query.points[k])
          .AddTo([&](int channel) -> double& { return totals[channel][k]; });
    }
  });
  const PointFormula<kWeighted> formula(scale);
  const unsigned gaps = formula(totals, samples);
  for (std::size_t k = 0; k < query.points.size(); ++k) {
    if ((gaps >> k & 1) == 0) continue;
    double third[kThirdSums] = {};
    ForEachChunk<false>(query.near, [&](const NeighbourChunk& chunk) HWY_ATTR {
      SumChunk<AddThirdSums>(inverse_square, query.near, chunk, query.points[k])
          .AddTo([&](int channel) -> double& { return third[channel]; });
    });
    const Point gradient = formula.GapGradient(totals, third, k);
    samples.gradient_x[k] = gradient.x;
    samples.gradient_y[k] = gradient.y;
  }
}

void SampleAtPoints(const Scale& scale, const PointQuery& query, PointSamples& samples) {
  query.near.weight != nullptr ? Sample<true>(scale, query, samples)
                               : Sample<false>(scale, query, samples);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SampleAtPoints);

void SampleAtPoints(const Scale& scale, const PointQuery& query, PointSamples& samples) {
  HWY_DYNAMIC_DISPATCH(SampleAtPoints)(scale, query, samples);
}

}  // namespace partiemc
#endif  // HWY_ONCE
