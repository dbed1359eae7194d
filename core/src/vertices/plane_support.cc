#include "vertices/plane_support.h"

#include <cstddef>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vertices/plane_support.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sampler/neighbour_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

enum SupportChannel { kWeight, kDistance, kSquare, kSupportSums };

HWY_INLINE Vector Constant(double value) { return hn::Set(Lanes(), static_cast<float>(value)); }

// B(d, r) from d^2 and 1 / r^2.
HWY_INLINE Vector Bump(Vector square, Vector inverse_square) {
  const Vector t =
      hn::Max(hn::Sub(Constant(1), hn::Mul(square, inverse_square)), hn::Zero(Lanes()));
  return hn::Mul(t, t);
}

struct Shape {
  HWY_INLINE explicit Shape(const SupportShape& support)
      : radius_square(Constant(support.radius * support.radius)),
        height(Constant(support.height)),
        inverse_square(Constant(1 / (support.radius * support.radius))),
        depth(Constant(support.depth)),
        inverse_spacing(Constant(1 / support.spacing)),
        lift(Constant(support.lift)) {}

  Vector radius_square, height, inverse_square, depth, inverse_spacing, lift;
};

// The sums of one plane over the particles of a chunk.
template <bool kSized>
HWY_INLINE PartialSums<kSupportSums> SumChunk(const NeighbourRows& near,
                                              const NeighbourChunk& chunk, const BentPlane& plane,
                                              const Shape& shape) {
  const Lanes d;
  const Vector x = Constant(plane.x - near.origin_x);
  const Vector y = Constant(plane.y - near.origin_y);
  const Vector normal_x = Constant(plane.normal_x);
  const Vector normal_y = Constant(plane.normal_y);
  const Vector half_curvature = Constant(plane.curvature * plane.size / 2);
  const Vector per_size = Constant(1 / plane.size);
  return PartialSums<kSupportSums>(chunk, [&](int k, Vector(&channels)[kSupportSums]) HWY_ATTR {
    Vector dx = hn::Sub(hn::Load(d, chunk.x + k), x);
    Vector dy = hn::Sub(hn::Load(d, chunk.y + k), y);
    Vector own = hn::Set(d, 1.0f);  // The particle's size over the plane's.
    if constexpr (kSized) {
      own = hn::Mul(hn::LoadU(d, chunk.factor + k), per_size);
      // Moves the particle to where one of the plane's size would have the same boundary.
      const Vector lift = hn::Mul(hn::Sub(own, hn::Set(d, 1.0f)), shape.lift);
      dx = hn::Add(hn::Mul(dx, per_size), hn::Mul(lift, normal_x));
      dy = hn::Add(hn::Mul(dy, per_size), hn::Mul(lift, normal_y));
    }
    const Vector along = hn::Sub(hn::Mul(normal_x, dy), hn::Mul(normal_y, dx));
    const Vector above = hn::Add(hn::Mul(dx, normal_x), hn::Mul(dy, normal_y));
    const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    const Vector along_square = hn::Mul(along, along);
    const Vector distance = hn::Add(above, hn::Mul(half_curvature, along_square));

    Vector w = hn::Max(hn::Add(hn::Mul(distance, shape.inverse_spacing), shape.depth), hn::Zero(d));
    for (int squaring = 0; squaring < 3; ++squaring) w = hn::Mul(w, w);
    if constexpr (kSized) w = hn::Mul(w, own);
    // Every term is masked, because weights and distances of far particles and of padding may be
    // NaN.
    const auto supports = hn::And(hn::Lt(square, shape.radius_square), hn::Lt(above, shape.height));
    w = hn::IfThenElseZero(supports, hn::Mul(Bump(square, shape.inverse_square), w));
    const Vector moment = hn::IfThenElseZero(supports, hn::Mul(w, distance));
    channels[kWeight] = hn::Add(channels[kWeight], w);
    channels[kDistance] = hn::Add(channels[kDistance], moment);
    channels[kSquare] =
        hn::Add(channels[kSquare], hn::IfThenElseZero(supports, hn::Mul(moment, distance)));
  });
}

template <Factor kFactor>
void SumSupportsOf(std::span<const SupportQuery> queries, const SupportShape& support,
                   std::span<QuerySupports> sums) {
  const Shape shape(support);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    for (std::size_t k = 0; k < queries[q].planes.size(); ++k) sums[q][k] = {};
  }
  const auto visit = [&](std::size_t q, const NeighbourChunk& chunk, bool) HWY_ATTR {
    const SupportQuery& query = queries[q];
    for (std::size_t k = 0; k < query.planes.size(); ++k) {
      double totals[kSupportSums] = {};
      SumChunk<kFactor == Factor::kSize>(query.near, chunk, query.planes[k], shape).AddTo(totals);
      sums[q][k].weight += totals[kWeight];
      sums[q][k].distance += totals[kDistance];
      sums[q][k].square += totals[kSquare];
    }
  };
  ForEachQuery<kFactor>(queries, visit);
}

void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 std::span<QuerySupports> sums) {
  queries.front().near.size != nullptr ? SumSupportsOf<Factor::kSize>(queries, support, sums)
                                       : SumSupportsOf<Factor::kNone>(queries, support, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(SumSupports);

void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 std::span<QuerySupports> sums) {
  HWY_DYNAMIC_DISPATCH(SumSupports)(queries, support, sums);
}

}  // namespace partiemc
#endif  // HWY_ONCE
