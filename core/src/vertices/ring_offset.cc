#include "vertices/ring_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vertices/ring_offset.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PARTIEMC_RING_OFFSET_ONCE
#define PARTIEMC_RING_OFFSET_ONCE
namespace partiemc {
namespace {

// Longest mitre, as a multiple of the offset.
constexpr double kMaxMitre = 2;

// Points that are moved together, by the normals of their segments and of the one before them.
constexpr std::size_t kPointsAtOnce = 64;

}  // namespace
}  // namespace partiemc
#endif

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Normals of the segments from some points on, each to the point that follows it in memory; `at` is
// where they go. Does as many as fill vectors of `d`, then what is left by single numbers.
template <class D>
HWY_INLINE std::size_t FindNormals(D d, const double* HWY_RESTRICT points, std::size_t at,
                                   std::size_t count, double* HWY_RESTRICT x,
                                   double* HWY_RESTRICT y) {
  const auto zero = hn::Zero(d);
  for (; at + hn::Lanes(d) <= count; at += hn::Lanes(d)) {
    hn::Vec<D> ax, ay, bx, by;
    hn::LoadInterleaved2(d, points + 2 * at, ax, ay);
    hn::LoadInterleaved2(d, points + 2 * at + 2, bx, by);
    const auto along_x = hn::Sub(by, ay);
    const auto along_y = hn::Sub(ax, bx);
    const auto length = hn::Sqrt(hn::Add(hn::Mul(along_x, along_x), hn::Mul(along_y, along_y)));
    const auto has_length = hn::Gt(length, zero);
    hn::StoreU(hn::IfThenElse(has_length, hn::Div(along_x, length), along_x), d, x + at);
    hn::StoreU(hn::IfThenElse(has_length, hn::Div(along_y, length), along_y), d, y + at);
  }
  return at;
}

// Moves points along the mitres of the normals before and after them: those of point k are k and
// k + 1 of `x` and `y`.
template <class D>
HWY_INLINE std::size_t MovePoints(D d, const double* HWY_RESTRICT points, std::size_t at,
                                  std::size_t count, const double* HWY_RESTRICT x,
                                  const double* HWY_RESTRICT y, double offset,
                                  double* HWY_RESTRICT target) {
  const auto one = hn::Set(d, 1.0);
  const auto least = hn::Set(d, 2 / (kMaxMitre * kMaxMitre));
  const auto by = hn::Set(d, offset);
  for (; at + hn::Lanes(d) <= count; at += hn::Lanes(d)) {
    const auto before_x = hn::LoadU(d, x + at), after_x = hn::LoadU(d, x + at + 1);
    const auto before_y = hn::LoadU(d, y + at), after_y = hn::LoadU(d, y + at + 1);
    // (a + b) / (1 + a . b) has length 1 / cos of half the turn.
    const auto divisor = hn::Max(
        hn::Add(hn::Add(one, hn::Mul(before_x, after_x)), hn::Mul(before_y, after_y)), least);
    hn::Vec<D> point_x, point_y;
    hn::LoadInterleaved2(d, points + 2 * at, point_x, point_y);
    const auto moved = [&](hn::Vec<D> point, hn::Vec<D> before, hn::Vec<D> after) {
      return hn::Add(point, hn::Div(hn::Mul(by, hn::Add(before, after)), divisor));
    };
    hn::StoreInterleaved2(moved(point_x, before_x, after_x), moved(point_y, before_y, after_y), d,
                          target + 2 * at);
  }
  return at;
}

void OffsetRingHere(std::span<const double> points, double offset, double* target) {
  const hn::ScalableTag<double> d;
  const hn::CappedTag<double, 1> d_one;
  const std::size_t count = points.size() / 2;
  // Normals of the segment before the first of some points, and of those after each of them.
  std::array<double, kPointsAtOnce + 1> x, y;
  const std::array<double, 4> closing = {points[2 * count - 2], points[2 * count - 1], points[0],
                                         points[1]};
  double closing_x, closing_y;
  FindNormals(d_one, closing.data(), 0, 1, &closing_x, &closing_y);
  x[0] = closing_x;
  y[0] = closing_y;
  for (std::size_t first = 0; first < count; first += kPointsAtOnce) {
    const std::size_t some = std::min(kPointsAtOnce, count - first);
    const double* const from = points.data() + 2 * first;
    // The last segment of the ring does not go on in memory.
    const std::size_t segments = first + some == count ? some - 1 : some;
    std::size_t done = FindNormals(d, from, 0, segments, x.data() + 1, y.data() + 1);
    FindNormals(d_one, from, done, segments, x.data() + 1, y.data() + 1);
    if (segments < some) {
      x[some] = closing_x;
      y[some] = closing_y;
    }
    done = MovePoints(d, from, 0, some, x.data(), y.data(), offset, target + 2 * first);
    MovePoints(d_one, from, done, some, x.data(), y.data(), offset, target + 2 * first);
    x[0] = x[some];
    y[0] = y[some];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(OffsetRingHere);

void OffsetRing(std::span<const double> points, double offset, double* target) {
  HWY_DYNAMIC_DISPATCH(OffsetRingHere)(points, offset, target);
}

}  // namespace partiemc
#endif  // HWY_ONCE
