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

SupportSums SumSupport(const NearRows& near, const SupportShape& shape, const BentPlane& plane) {
  const Lanes d;
  const Vector x = hn::Set(d, plane.x);
  const Vector y = hn::Set(d, plane.y);
  const Vector normal_x = hn::Set(d, plane.normal_x);
  const Vector normal_y = hn::Set(d, plane.normal_y);
  const Vector half_curvature = hn::Set(d, plane.curvature / 2);
  const Vector square_radius = hn::Set(d, shape.radius * shape.radius);
  const Vector height = hn::Set(d, shape.height);
  const Vector inverse_square = hn::Set(d, 1 / (shape.half_width * shape.half_width));
  const Vector inverse_spacing = hn::Set(d, 1 / shape.spacing);
  const Vector depth = hn::Set(d, shape.depth);
  Vector distances[kParts], weights[kParts];
  for (int part = 0; part < kParts; ++part) distances[part] = weights[part] = hn::Zero(d);

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
        const auto counts = hn::And(hn::Lt(hn::Iota(d, 0.0), hn::Set(d, static_cast<double>(left))),
                                    hn::And(hn::Lt(square, square_radius), hn::Lt(above, height)));
        const Vector along_square = hn::Mul(along, along);
        const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));
        const Vector t =
            hn::Max(hn::Sub(hn::Set(d, 1.0), hn::Mul(along_square, inverse_square)), hn::Zero(d));
        Vector w = hn::Max(hn::Add(hn::Mul(distance, inverse_spacing), depth), hn::Zero(d));
        for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
        w = hn::IfThenElseZero(counts, hn::Mul(hn::Mul(t, t), w));
        distances[part] = hn::Add(distances[part], hn::Mul(w, distance));
        weights[part] = hn::Add(weights[part], w);
      }
    }
  }
  return {SumOfParts(distances), SumOfParts(weights)};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumSupport);

SupportSums SumSupport(const NearRows& near, const SupportShape& shape, const BentPlane& plane) {
  return HWY_DYNAMIC_DISPATCH(SumSupport)(near, shape, plane);
}

}  // namespace partiemc
#endif  // HWY_ONCE
