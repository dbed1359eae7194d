#include "plane_support.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plane_support.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "point_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// B(d, s) by d^2 and 1 / s^2.
template <class D>
HWY_INLINE hn::Vec<D> Bump(D d, hn::Vec<D> square, hn::Vec<D> inverse_square) {
  const auto t = hn::Max(hn::Sub(hn::Set(d, 1.0), hn::Mul(square, inverse_square)), hn::Zero(d));
  return hn::Mul(t, t);
}

// `Points` is OnePoint or TwoPoints; results[p] are the sums of point p.
template <bool kWeighted, typename Points>
HWY_INLINE void Sum(const SupportQuery& entries, const SupportShape& support,
                    const StripShape& strip, Points points,
                    SupportSums (&results)[Points::kPoints]) {
  using D = typename Points::D;
  using Vector = typename Points::Vector;
  constexpr int kParts = Points::kParts;
  const D d;
  const auto inverse_square = [d](double length)
                                  HWY_ATTR { return hn::Set(d, 1 / (length * length)); };
  const auto of_plane = [&](auto value) HWY_ATTR {
    return points.PerPoint([&](const SupportQuery& query) { return value(query.plane); });
  };
  const Vector x = of_plane([](const BentPlane& plane) { return plane.x; });
  const Vector y = of_plane([](const BentPlane& plane) { return plane.y; });
  const Vector normal_x = of_plane([](const BentPlane& plane) { return plane.normal_x; });
  const Vector normal_y = of_plane([](const BentPlane& plane) { return plane.normal_y; });
  const Vector half_curvature =
      of_plane([](const BentPlane& plane) { return plane.curvature / 2; });
  const Vector support_radius = hn::Set(d, support.radius * support.radius);
  const Vector support_height = hn::Set(d, support.height);
  const Vector support_width = inverse_square(support.half_width);
  const Vector support_depth = hn::Set(d, support.depth);
  const Vector inverse_spacing = hn::Set(d, 1 / support.spacing);
  const Vector strip_radius = hn::Set(d, strip.radius * strip.radius);
  const Vector strip_height = hn::Set(d, strip.height);
  const Vector strip_width = inverse_square(strip.half_width);
  const Vector strip_depth = inverse_square(strip.depth);
  Vector distances[kParts], weights[kParts], volumes[kParts];
  for (int part = 0; part < kParts; ++part) {
    distances[part] = weights[part] = volumes[part] = hn::Zero(d);
  }

  points.ForEachVector([&](int part) HWY_ATTR {
    const Vector dx = hn::Sub(points.Load(entries.x), x);
    const Vector dy = hn::Sub(points.Load(entries.y), y);
    const Vector along = hn::Sub(hn::Mul(normal_x, dy), hn::Mul(normal_y, dx));
    const Vector above = hn::Add(hn::Mul(dx, normal_x), hn::Mul(dy, normal_y));
    const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    const auto is_entry = points.IsEntry();
    const Vector along_square = hn::Mul(along, along);
    const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));

    Vector w = hn::Max(hn::Add(hn::Mul(distance, inverse_spacing), support_depth), hn::Zero(d));
    for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
    const auto supports = hn::And(hn::Lt(square, support_radius), hn::Lt(above, support_height));
    w = hn::IfThenElseZero(hn::And(is_entry, supports),
                           hn::Mul(Bump(d, along_square, support_width), w));
    distances[part] = hn::Add(distances[part], hn::Mul(w, distance));
    weights[part] = hn::Add(weights[part], w);

    const Vector below = hn::Min(distance, hn::Zero(d));
    Vector volume =
        hn::Mul(Bump(d, along_square, strip_width), Bump(d, hn::Mul(below, below), strip_depth));
    if constexpr (kWeighted) volume = hn::Mul(volume, points.Load(entries.weight));
    const auto is_in_strip = hn::And(hn::Lt(square, strip_radius), hn::Lt(above, strip_height));
    volumes[part] =
        hn::Add(volumes[part], hn::IfThenElseZero(hn::And(is_entry, is_in_strip), volume));
  });
  HWY_ALIGN double totals[2][Points::kPoints * kPointPadding];
  StoreTotals(d, distances, weights, totals[0]);
  StoreTotals(d, volumes, volumes, totals[1]);
  for (int point = 0; point < Points::kPoints; ++point) {
    const int at = point * kPointPadding;
    results[point] = {totals[0][at], totals[0][at + 1], totals[1][at]};
  }
}

SupportSums SumOne(const SupportQuery& query, const SupportShape& support,
                   const StripShape& strip) {
  SupportSums sums[1];
  query.weight == nullptr ? Sum<false>(query, support, strip, OnePoint(query), sums)
                          : Sum<true>(query, support, strip, OnePoint(query), sums);
  return sums[0];
}

SupportSums SumSupport(const SupportQuery& query, const SupportShape& support,
                       const StripShape& strip) {
  return SumOne(query, support, strip);
}

std::array<SupportSums, 2> SumTwoSupports(const SupportQuery& first, const SupportQuery& second,
                                          const SupportShape& support, const StripShape& strip) {
#if PARTIEMC_TWO_POINTS_FIT
  SupportSums sums[2];
  const TwoPoints points(first, second);
  first.weight == nullptr ? Sum<false>(first, support, strip, points, sums)
                          : Sum<true>(first, support, strip, points, sums);
  return {sums[0], sums[1]};
#else
  return {SumOne(first, support, strip), SumOne(second, support, strip)};
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumSupport);
HWY_EXPORT(SumTwoSupports);

SupportSums SumSupport(const SupportQuery& query, const SupportShape& support,
                       const StripShape& strip) {
  return HWY_DYNAMIC_DISPATCH(SumSupport)(query, support, strip);
}

std::array<SupportSums, 2> SumTwoSupports(const SupportQuery& first, const SupportQuery& second,
                                          const SupportShape& support, const StripShape& strip) {
  return HWY_DYNAMIC_DISPATCH(SumTwoSupports)(first, second, support, strip);
}

}  // namespace partiemc
#endif  // HWY_ONCE
