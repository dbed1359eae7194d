#include "sampler/point_kernels.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sampler/point_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sampler/neighbour_sums-inl.h"
#include "sampler/point_formula-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// Terms of one SIMD vector of particles: d = particle - point, divided by the particle's size if
// sizes differ; t = max(0, 1 - |d|^2 / R^2); t^2; 1 / size, or 0 if sizes are equal.
struct Terms {
  Vector dx, dy, t, t2, per_size;
};

// A derivative of kernels by a coordinate of the point. `term`: without the factor 1 / size.
template <Factor kFactor>
HWY_INLINE Vector Derivative(Vector term, const Terms& terms) {
  if constexpr (kFactor == Factor::kSize) return hn::Mul(term, terms.per_size);
  return term;
}

template <int kChannels>
HWY_INLINE void Add(Vector (&sums)[kChannels], int channel, Vector term) {
  sums[channel] = hn::Add(sums[channel], term);
}

template <Factor kFactor>
struct AddSums {
  static constexpr int kChannels = kChannelsOf<kFactor>;

  HWY_INLINE void operator()([[maybe_unused]] const float* factor, const Terms& terms,
                             Vector (&sums)[kChannels]) const {
    const auto& [dx, dy, t, t2, per_size] = terms;
    const Vector k = hn::Mul(t2, t);
    Add(sums, kKernel, k);
    const Vector slope_x = hn::Mul(t2, dx);
    const Vector slope_y = hn::Mul(t2, dy);
    Add(sums, kSlopeX, Derivative<kFactor>(slope_x, terms));
    Add(sums, kSlopeY, Derivative<kFactor>(slope_y, terms));
    Add(sums, kMomentX, hn::Mul(k, dx));
    Add(sums, kMomentY, hn::Mul(k, dy));
    const Vector xx = hn::Mul(slope_x, dx);
    const Vector xy = hn::Mul(slope_x, dy);
    const Vector yy = hn::Mul(slope_y, dy);
    Add(sums, kXx, Derivative<kFactor>(xx, terms));
    Add(sums, kXy, Derivative<kFactor>(xy, terms));
    Add(sums, kYy, Derivative<kFactor>(yy, terms));
    Add(sums, kKxx, hn::Mul(t, xx));
    Add(sums, kKxy, hn::Mul(t, xy));
    Add(sums, kKyy, hn::Mul(t, yy));
    if constexpr (kFactor == Factor::kWeight) {
      const Vector w = hn::LoadU(Lanes(), factor);
      Add(sums, kDensity, hn::Mul(w, k));
      Add(sums, kDensityX, hn::Mul(w, slope_x));
      Add(sums, kDensityY, hn::Mul(w, slope_y));
    }
    if constexpr (kFactor == Factor::kSize) {
      Add(sums, kSize, hn::Mul(k, hn::LoadU(Lanes(), factor)));
      Add(sums, kPerSize, hn::Mul(k, per_size));
    }
  }
};

template <Factor kFactor>
struct AddThirdSums {
  static constexpr int kChannels = kThirdSums;

  HWY_INLINE void operator()(const float*, const Terms& terms, Vector (&sums)[kChannels]) const {
    const auto& [dx, dy, t, t2, per_size] = terms;
    const Vector xx = Derivative<kFactor>(hn::Mul(hn::Mul(t2, dx), dx), terms);
    const Vector yy = Derivative<kFactor>(hn::Mul(hn::Mul(t2, dy), dy), terms);
    Add(sums, kXxx, hn::Mul(xx, dx));
    Add(sums, kXxy, hn::Mul(xx, dy));
    Add(sums, kXyy, hn::Mul(yy, dx));
    Add(sums, kYyy, hn::Mul(yy, dy));
    if constexpr (kFactor == Factor::kSize) {
      const Vector k = hn::Mul(hn::Mul(t2, t), per_size);
      Add(sums, kPerSizeX, hn::Mul(k, dx));
      Add(sums, kPerSizeY, hn::Mul(k, dy));
    }
  }
};

// The sums over the particles of a chunk at a point.
template <Factor kFactor, typename AddTerms>
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
        Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
        Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
        Vector per_size = hn::Zero(d);
        if constexpr (kFactor == Factor::kSize) {
          per_size = hn::Div(hn::Set(d, 1.0f), hn::LoadU(d, chunk.factor + k));
          dx = hn::Mul(dx, per_size);
          dy = hn::Mul(dy, per_size);
        }
        const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        const Vector t = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, scale)));
        AddTerms()(chunk.factor + k, Terms{dx, dy, t, hn::Mul(t, t), per_size}, channels);
      });
}

template <Factor kFactor>
void SumThird(double inverse_square, const NeighbourRows& near, const Point& point,
              double (&totals)[kThirdSums]) {
  // Weights do not matter.
  constexpr Factor kNeeded = kFactor == Factor::kSize ? Factor::kSize : Factor::kNone;
  NeighbourChunk room;
  ForEachChunk<kNeeded>(near, room, [&](const NeighbourChunk& chunk) HWY_ATTR {
    SumChunk<kNeeded, AddThirdSums<kNeeded>>(inverse_square, near, chunk, point).AddTo(totals);
  });
}

// Sums at the points of some queries. The totals of all points are computed at once. If a query has
// several chunks, the totals of its chunks are added in doubles, point by point.
template <Factor kFactor>
class SumsAtPoints {
 public:
  HWY_INLINE SumsAtPoints(double inverse_square, std::span<const PointQuery> queries) {
    std::size_t first[kQueriesAtOnce];
    for (std::size_t q = 0; q < queries.size(); ++q) {
      first[q] = count_;
      count_ += queries[q].points.size();
    }
    const auto visit = [&](std::size_t q, const NeighbourChunk& chunk, bool is_all) HWY_ATTR {
      const PointQuery& query = queries[q];
      for (std::size_t k = 0; k < query.points.size(); ++k) {
        PartialSums<kChannels> sums =
            SumChunk<kFactor, AddSums<kFactor>>(inverse_square, query.near, chunk, query.points[k]);
        if (count_ > kFewPoints) sums.Store(parts_, first[q] + k);
        if (HWY_UNLIKELY(!is_all || count_ <= kFewPoints)) AddAlone(first[q] + k, sums);
      }
    };
    ForEachQuery<kFactor>(queries, visit);
    if (count_ > kFewPoints) {
      Total();
      for (std::size_t point = 0; alone_ >> point != 0; ++point) {
        if ((alone_ >> point & 1) != 0) TakeAlone(point, point);
      }
    } else {
      // Whole vectors are computed, so the lanes after the last point need defined values.
      constexpr std::size_t kEnd = std::max(kFewPoints, PointFormula<kFactor>::kLanes);
      for (std::size_t point = 0; point < kEnd; ++point) {
        TakeAlone(std::min(point, count_ - 1), point);
      }
    }
  }

  std::size_t count() const { return count_; }
  const typename PointFormula<kFactor>::Totals& totals() const { return totals_; }

 private:
  static constexpr int kChannels = AddSums<kFactor>::kChannels;
  // Up to this number of points, computing the totals point by point is faster.
  static constexpr std::size_t kFewPoints = 2;
  static_assert(PointSamples::kCapacity % kPartialSums == 0 && PointSamples::kCapacity < 64);

  HWY_INLINE void AddAlone(std::size_t point, PartialSums<kChannels>& sums) {
    double(&totals)[kChannels] = totals_alone_[point];
    if ((alone_ >> point & 1) == 0) std::fill(std::begin(totals), std::end(totals), 0.0);
    alone_ |= std::uint64_t{1} << point;
    sums.AddTo(totals);
  }

  void TakeAlone(std::size_t from, std::size_t to) {
    for (int channel = 0; channel < kChannels; ++channel) {
      totals_[channel][to] = totals_alone_[from][channel];
    }
  }

  HWY_INLINE void Total() {
    const hn::CappedTag<double, kPartialSums> d;
    const hn::Rebind<float, decltype(d)> d_float;
    HWY_ALIGN float totals[kLanes];
    for (int channel = 0; channel < kChannels; ++channel) {
      for (std::size_t first = 0; first < count_; first += kLanes) {
        hn::Store(TotalsAtPoints(parts_[channel], first, count_ - 1), Lanes(), totals);
        for (std::size_t k = 0; k < kLanes; k += hn::Lanes(d)) {
          hn::Store(hn::PromoteTo(d, hn::Load(d_float, totals + k)), d,
                    totals_[channel] + first + k);
        }
      }
    }
  }

  std::size_t count_ = 0;
  std::uint64_t alone_ = 0;  // Points with totals_alone_: bit k is point k.
  HWY_ALIGN float parts_[kChannels][PointSamples::kCapacity][kPartialSums];
  HWY_ALIGN typename PointFormula<kFactor>::Totals totals_;
  double totals_alone_[PointSamples::kCapacity][kChannels];
};

template <Factor kFactor>
HWY_INLINE void Sample(const Scale& scale, std::span<const PointQuery> queries,
                       PointSamples& samples) {
  const double inverse_square = 1 / (scale.kernel_radius * scale.kernel_radius);
  const SumsAtPoints<kFactor> sums(inverse_square, queries);
  const PointFormula<kFactor> formula(scale);
  const std::uint64_t gaps = formula(sums.totals(), sums.count(), samples);
  if (gaps == 0) return;
  std::size_t point = 0;
  for (const PointQuery& query : queries) {
    for (std::size_t k = 0; k < query.points.size(); ++k, ++point) {
      if ((gaps >> point & 1) == 0) continue;
      double third[kThirdSums] = {};
      SumThird<kFactor>(inverse_square, query.near, query.points[k], third);
      const Point gradient = formula.GapGradient(sums.totals(), third, point);
      samples.gradient_x[point] = gradient.x;
      samples.gradient_y[point] = gradient.y;
    }
  }
}

void SampleAtPoints(const Scale& scale, std::span<const PointQuery> queries,
                    PointSamples& samples) {
  const NeighbourRows& near = queries.front().near;
  near.size != nullptr     ? Sample<Factor::kSize>(scale, queries, samples)
  : near.weight != nullptr ? Sample<Factor::kWeight>(scale, queries, samples)
                           : Sample<Factor::kNone>(scale, queries, samples);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SampleAtPoints);

void SampleAtPoints(const Scale& scale, std::span<const PointQuery> queries,
                    PointSamples& samples) {
  HWY_DYNAMIC_DISPATCH(SampleAtPoints)(scale, queries, samples);
}

}  // namespace partiemc
#endif  // HWY_ONCE
