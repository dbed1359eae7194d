#include "vertices/measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#ifndef PARTIEMC_MEASURE_ONCE
#define PARTIEMC_MEASURE_ONCE
namespace partiemc {
namespace {

// Segments whose terms are found together, before any of them is added.
constexpr std::size_t kSegmentsAtOnce = 64;

// What segments add to the sums of a ring.
struct SegmentTerms {
  using PerSegment = std::array<double, kSegmentsAtOnce>;
  PerSegment cross, moment_x, moment_y, length;
};

}  // namespace
}  // namespace partiemc
#endif

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vertices/measure.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Terms of the segments `at` to `count`, each from a point to the one that follows it in memory,
// relative to (x0, y0). Does as many as fill vectors of `d`; returns where it stopped.
template <class D>
HWY_INLINE std::size_t FindTerms(D d, const double* HWY_RESTRICT points, std::size_t at,
                                 std::size_t count, double x0, double y0, SegmentTerms& terms) {
  const auto from_x = hn::Set(d, x0), from_y = hn::Set(d, y0);
  for (; at + hn::Lanes(d) <= count; at += hn::Lanes(d)) {
    hn::Vec<D> ax, ay, bx, by;
    hn::LoadInterleaved2(d, points + 2 * at, ax, ay);
    hn::LoadInterleaved2(d, points + 2 * at + 2, bx, by);
    ax = hn::Sub(ax, from_x);
    ay = hn::Sub(ay, from_y);
    bx = hn::Sub(bx, from_x);
    by = hn::Sub(by, from_y);
    const auto cross = hn::Sub(hn::Mul(ax, by), hn::Mul(bx, ay));
    const auto dx = hn::Sub(bx, ax), dy = hn::Sub(by, ay);
    hn::StoreU(cross, d, terms.cross.data() + at);
    hn::StoreU(hn::Mul(hn::Add(ax, bx), cross), d, terms.moment_x.data() + at);
    hn::StoreU(hn::Mul(hn::Add(ay, by), cross), d, terms.moment_y.data() + at);
    hn::StoreU(hn::Sqrt(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy))), d, terms.length.data() + at);
  }
  return at;
}

RingMeasures MeasureRingHere(std::span<const double> points) {
  const hn::ScalableTag<double> d;
  const hn::CappedTag<double, 1> d_one;
  RingMeasures measures;
  const double x0 = points[0];
  const double y0 = points[1];
  const std::size_t count = points.size() / 2;
  double twice_area = 0, moment_x = 0, moment_y = 0;
  SegmentTerms terms;
  // One after the other, in the order of the ring.
  const auto add = [&](std::size_t segments) {
    for (std::size_t k = 0; k < segments; ++k) {
      twice_area += terms.cross[k];
      moment_x += terms.moment_x[k];
      moment_y += terms.moment_y[k];
      measures.perimeter += terms.length[k];
    }
  };
  for (std::size_t first = 0; first + 1 < count; first += kSegmentsAtOnce) {
    const std::size_t some = std::min(kSegmentsAtOnce, count - 1 - first);
    const double* const from = points.data() + 2 * first;
    const std::size_t done = FindTerms(d, from, 0, some, x0, y0, terms);
    FindTerms(d_one, from, done, some, x0, y0, terms);
    add(some);
  }
  // The last segment does not go on in memory.
  const std::array<double, 4> closing = {points[2 * count - 2], points[2 * count - 1], x0, y0};
  FindTerms(d_one, closing.data(), 0, 1, x0, y0, terms);
  add(1);
  measures.area = twice_area / 2;
  const bool flat = twice_area == 0;
  measures.centroid_x = x0 + (flat ? 0 : moment_x / (3 * twice_area));
  measures.centroid_y = y0 + (flat ? 0 : moment_y / (3 * twice_area));
  return measures;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(MeasureRingHere);

RingMeasures MeasureRing(std::span<const double> points) {
  return HWY_DYNAMIC_DISPATCH(MeasureRingHere)(points);
}

}  // namespace partiemc
#endif  // HWY_ONCE
