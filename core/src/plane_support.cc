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

HWY_INLINE double SumOfParts(const Vector* sums) {
  HWY_ALIGN double parts[kPointPadding];
  for (int part = 0; part < kParts; ++part) {
    hn::Store(sums[part], Lanes(), parts + part * kLanes);
  }
  return (parts[0] + parts[1]) + (parts[2] + parts[3]);
}

// B(d, s) by d^2 and 1 / s^2.
HWY_INLINE Vector Bump(Vector square, Vector inverse_square) {
  const Lanes d;
  const Vector t = hn::Max(hn::Sub(hn::Set(d, 1.0), hn::Mul(square, inverse_square)), hn::Zero(d));
  return hn::Mul(t, t);
}

template <bool kWeighted>
SupportSums Sum(const NearRows& near, const SupportShape& support, const StripShape& strip,
                const BentPlane& plane) {
  const Lanes d;
  const auto inverse_square = [d](double length)
                                  HWY_ATTR { return hn::Set(d, 1 / (length * length)); };
  const Vector x = hn::Set(d, plane.x);
  const Vector y = hn::Set(d, plane.y);
  const Vector normal_x = hn::Set(d, plane.normal_x);
  const Vector normal_y = hn::Set(d, plane.normal_y);
  const Vector half_curvature = hn::Set(d, plane.curvature / 2);
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

  for (int row = 0; row < near.rows; ++row) {
    const std::uint32_t* offsets = near.offsets + row * near.row_stride;
    const std::uint32_t end = offsets[near.columns];
    for (std::uint32_t entry = offsets[0]; entry < end; entry += kPointPadding) {
      for (int part = 0; part < kParts; ++part) {
        const std::uint32_t at = entry + part * kLanes;
        const int left = static_cast<int>(end - entry) - part * kLanes;
        const Vector dx = hn::Sub(LoadDouble(near.x + at), x);
        const Vector dy = hn::Sub(LoadDouble(near.y + at), y);
        const Vector along = hn::Sub(hn::Mul(normal_x, dy), hn::Mul(normal_y, dx));
        const Vector above = hn::Add(hn::Mul(dx, normal_x), hn::Mul(dy, normal_y));
        const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        // Lanes past the end of the row hold other entries, or none.
        const auto is_listed = hn::Lt(hn::Iota(d, 0.0), hn::Set(d, static_cast<double>(left)));
        const Vector along_square = hn::Mul(along, along);
        const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));

        Vector w = hn::Max(hn::Add(hn::Mul(distance, inverse_spacing), support_depth), hn::Zero(d));
        for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
        const auto supports =
            hn::And(hn::Lt(square, support_radius), hn::Lt(above, support_height));
        w = hn::IfThenElseZero(hn::And(is_listed, supports),
                               hn::Mul(Bump(along_square, support_width), w));
        distances[part] = hn::Add(distances[part], hn::Mul(w, distance));
        weights[part] = hn::Add(weights[part], w);

        const Vector below = hn::Min(distance, hn::Zero(d));
        Vector volume =
            hn::Mul(Bump(along_square, strip_width), Bump(hn::Mul(below, below), strip_depth));
        if constexpr (kWeighted) volume = hn::Mul(volume, LoadDouble(near.weight + at));
        const auto is_in_strip = hn::And(hn::Lt(square, strip_radius), hn::Lt(above, strip_height));
        volumes[part] =
            hn::Add(volumes[part], hn::IfThenElseZero(hn::And(is_listed, is_in_strip), volume));
      }
    }
  }
  return {SumOfParts(distances), SumOfParts(weights), SumOfParts(volumes)};
}

SupportSums SumSupport(const NearRows& near, const SupportShape& support, const StripShape& strip,
                       const BentPlane& plane) {
  return near.weight == nullptr ? Sum<false>(near, support, strip, plane)
                                : Sum<true>(near, support, strip, plane);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumSupport);

SupportSums SumSupport(const NearRows& near, const SupportShape& support, const StripShape& strip,
                       const BentPlane& plane) {
  return HWY_DYNAMIC_DISPATCH(SumSupport)(near, support, strip, plane);
}

}  // namespace partiemc
#endif  // HWY_ONCE
