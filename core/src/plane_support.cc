#include "plane_support.h"

#include <cstddef>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plane_support.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "near_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

enum SupportChannel { kDistance, kWeight, kVolume, kSupportSums };

HWY_INLINE Vector Constant(double value) { return hn::Set(Lanes(), static_cast<float>(value)); }

// B(d, s) by d^2 and 1 / s^2.
HWY_INLINE Vector Bump(Vector square, Vector inverse_square) {
  const Vector t =
      hn::Max(hn::Sub(Constant(1), hn::Mul(square, inverse_square)), hn::Zero(Lanes()));
  return hn::Mul(t, t);
}

// Adds a chunk's particles to the sums of a plane.
template <bool kWeighted>
HWY_INLINE void SumChunk(const NearRows& near, const NearChunk& chunk, const BentPlane& plane,
                         const SupportShape& support, const StripShape& strip,
                         double (&totals)[kSupportSums]) {
  const Lanes d;
  const auto inverse_square = [](double length)
                                  HWY_ATTR { return Constant(1 / (length * length)); };
  const Vector x = Constant(plane.x - near.origin_x);
  const Vector y = Constant(plane.y - near.origin_y);
  const Vector normal_x = Constant(plane.normal_x);
  const Vector normal_y = Constant(plane.normal_y);
  const Vector half_curvature = Constant(plane.curvature / 2);
  const Vector support_radius = Constant(support.radius * support.radius);
  const Vector support_height = Constant(support.height);
  const Vector support_width = inverse_square(support.half_width);
  const Vector support_depth = Constant(support.depth);
  const Vector inverse_spacing = Constant(1 / support.spacing);
  const Vector strip_radius = Constant(strip.radius * strip.radius);
  const Vector strip_height = Constant(strip.height);
  const Vector strip_width = inverse_square(strip.half_width);
  const Vector strip_depth = inverse_square(strip.depth);
  PartialSums<kSupportSums> sums(chunk, [&](int k, Vector(&channels)[kSupportSums]) HWY_ATTR {
    const Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
    const Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
    const Vector along = hn::Sub(hn::Mul(normal_x, dy), hn::Mul(normal_y, dx));
    const Vector above = hn::Add(hn::Mul(dx, normal_x), hn::Mul(dy, normal_y));
    const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    const Vector along_square = hn::Mul(along, along);
    const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));

    Vector w = hn::Max(hn::Add(hn::Mul(distance, inverse_spacing), support_depth), hn::Zero(d));
    for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
    const auto supports = hn::And(hn::Lt(square, support_radius), hn::Lt(above, support_height));
    w = hn::IfThenElseZero(supports, hn::Mul(Bump(along_square, support_width), w));
    channels[kDistance] =
        hn::Add(channels[kDistance], hn::IfThenElseZero(supports, hn::Mul(w, distance)));
    channels[kWeight] = hn::Add(channels[kWeight], w);

    const Vector below = hn::Min(distance, hn::Zero(d));
    Vector volume =
        hn::Mul(Bump(along_square, strip_width), Bump(hn::Mul(below, below), strip_depth));
    if constexpr (kWeighted) volume = hn::Mul(volume, hn::Load(d, chunk.weight + k));
    const auto is_in_strip = hn::And(hn::Lt(square, strip_radius), hn::Lt(above, strip_height));
    channels[kVolume] = hn::Add(channels[kVolume], hn::IfThenElseZero(is_in_strip, volume));
  });
  sums.AddTo(totals);
}

template <bool kWeighted>
HWY_INLINE void Sum(std::span<const SupportQuery> queries, const SupportShape& support,
                    const StripShape& strip, std::span<QuerySupports> sums) {
  double totals[kQueriesAtOnce][kPointsAtOnce][kSupportSums] = {};
  ForEachQuery<kWeighted>(queries, [&](std::size_t q, const NearChunk& chunk, bool) HWY_ATTR {
    const SupportQuery& query = queries[q];
    for (std::size_t k = 0; k < query.count; ++k) {
      SumChunk<kWeighted>(query.near, chunk, query.planes[k], support, strip, totals[q][k]);
    }
  });
  for (std::size_t q = 0; q < queries.size(); ++q) {
    for (std::size_t k = 0; k < queries[q].count; ++k) {
      const auto& of = totals[q][k];
      sums[q][k] = {of[kDistance], of[kWeight], of[kVolume]};
    }
  }
}

void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 const StripShape& strip, std::span<QuerySupports> sums) {
  queries.front().near.weight != nullptr ? Sum<true>(queries, support, strip, sums)
                                         : Sum<false>(queries, support, strip, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumSupports);

void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 const StripShape& strip, std::span<QuerySupports> sums) {
  HWY_DYNAMIC_DISPATCH(SumSupports)(queries, support, strip, sums);
}

}  // namespace partiemc
#endif  // HWY_ONCE
