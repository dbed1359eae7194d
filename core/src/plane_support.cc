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

HWY_INLINE Vector InverseSquare(double length) { return Constant(1 / (length * length)); }

// What planes have in common.
struct Shapes {
  HWY_INLINE Shapes(const SupportShape& support, const StripShape& strip)
      : support_radius(Constant(support.radius * support.radius)),
        support_height(Constant(support.height)),
        support_width(InverseSquare(support.half_width)),
        support_depth(Constant(support.depth)),
        inverse_spacing(Constant(1 / support.spacing)),
        strip_radius(Constant(strip.radius * strip.radius)),
        strip_height(Constant(strip.height)),
        strip_width(InverseSquare(strip.half_width)),
        strip_depth(InverseSquare(strip.depth)) {}

  // Radii squared; widths and the strip's depth as Bump takes them.
  Vector support_radius, support_height, support_width, support_depth, inverse_spacing;
  Vector strip_radius, strip_height, strip_width, strip_depth;
};

// The sums over a chunk's particles for a plane.
template <bool kWeighted>
HWY_INLINE PartialSums<kSupportSums> SumChunk(const NearRows& near, const NearChunk& chunk,
                                              const BentPlane& plane, const Shapes& shapes) {
  const Lanes d;
  const Vector x = Constant(plane.x - near.origin_x);
  const Vector y = Constant(plane.y - near.origin_y);
  const Vector normal_x = Constant(plane.normal_x);
  const Vector normal_y = Constant(plane.normal_y);
  const Vector half_curvature = Constant(plane.curvature / 2);
  return PartialSums<kSupportSums>(chunk, [&](int k, Vector(&channels)[kSupportSums]) HWY_ATTR {
    const Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
    const Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
    const Vector along = hn::Sub(hn::Mul(normal_x, dy), hn::Mul(normal_y, dx));
    const Vector above = hn::Add(hn::Mul(dx, normal_x), hn::Mul(dy, normal_y));
    const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    const Vector along_square = hn::Mul(along, along);
    const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));

    Vector w = hn::Max(hn::Add(hn::Mul(distance, shapes.inverse_spacing), shapes.support_depth),
                       hn::Zero(d));
    for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
    const auto supports =
        hn::And(hn::Lt(square, shapes.support_radius), hn::Lt(above, shapes.support_height));
    w = hn::IfThenElseZero(supports, hn::Mul(Bump(along_square, shapes.support_width), w));
    channels[kDistance] =
        hn::Add(channels[kDistance], hn::IfThenElseZero(supports, hn::Mul(w, distance)));
    channels[kWeight] = hn::Add(channels[kWeight], w);

    const Vector below = hn::Min(distance, hn::Zero(d));
    Vector volume = hn::Mul(Bump(along_square, shapes.strip_width),
                            Bump(hn::Mul(below, below), shapes.strip_depth));
    if constexpr (kWeighted) volume = hn::Mul(volume, hn::Load(d, chunk.weight + k));
    const auto is_in_strip =
        hn::And(hn::Lt(square, shapes.strip_radius), hn::Lt(above, shapes.strip_height));
    channels[kVolume] = hn::Add(channels[kVolume], hn::IfThenElseZero(is_in_strip, volume));
  });
}

template <bool kWeighted>
HWY_INLINE void Sum(std::span<const SupportQuery> queries, const SupportShape& support,
                    const StripShape& strip, std::span<QuerySupports> sums) {
  const Shapes shapes(support, strip);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    for (std::size_t k = 0; k < queries[q].planes.size(); ++k) sums[q][k] = {};
  }
  const auto visit = [&](std::size_t q, const NearChunk& chunk, bool) HWY_ATTR {
    const SupportQuery& query = queries[q];
    for (std::size_t k = 0; k < query.planes.size(); ++k) {
      double totals[kSupportSums] = {};
      SumChunk<kWeighted>(query.near, chunk, query.planes[k], shapes).AddTo(totals);
      sums[q][k].distance += totals[kDistance];
      sums[q][k].weight += totals[kWeight];
      sums[q][k].volume += totals[kVolume];
    }
  };
  ForEachQuery<kWeighted>(queries, visit);
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
