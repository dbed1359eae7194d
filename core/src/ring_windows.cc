#include "ring_windows.h"

#include <algorithm>

#include "normals.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ring_windows.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, kWindowPadding>;
using Vector = hn::Vec<Lanes>;
constexpr auto kLanes = static_cast<std::ptrdiff_t>(hn::MaxLanes(Lanes()));

HWY_INLINE Vector Dot(Vector ax, Vector ay, Vector bx, Vector by) {
  return hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by));
}

// Falls from 1 to 0.1 at 30 degrees: what lies beyond a corner has no say.
HWY_INLINE Vector AngleWeight(Vector cosine) {
  Vector power = hn::Max(cosine, hn::Zero(Lanes()));
  for (int squaring = 0; squaring < 4; ++squaring) power = hn::Mul(power, power);
  return power;
}

// Goes over the vertices [begin, end) by as many as there are lanes: in each block it calls
// add(first, j, w) for every offset that is in the window of one of the block's vertices; j is the
// neighbour of the first vertex, w the weights of the neighbours, 0 beyond a window. Then
// finish(first, lanes).
template <typename Start, typename Add, typename Finish>
HWY_INLINE void ForEachWindow(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                              double reach, Start start, Add add, Finish finish) {
  const Lanes d;
  const double* const arc = ring.arc;
  const Vector one = hn::Set(d, 1.0);
  const Vector inverse_square = hn::Set(d, 1 / (reach * reach));
  std::ptrdiff_t low = begin;
  std::ptrdiff_t high = begin;
  while (arc[begin] - arc[low - 1] < reach) --low;
  for (std::ptrdiff_t first = begin; first < end; first += kLanes) {
    const std::ptrdiff_t lanes = std::min(kLanes, end - first);
    std::ptrdiff_t before = 0;
    std::ptrdiff_t after = 0;
    for (std::ptrdiff_t k = first; k < first + lanes; ++k) {
      while (arc[k] - arc[low] >= reach) ++low;
      while (arc[high + 1] - arc[k] < reach) ++high;
      before = std::max(before, k - low);
      after = std::max(after, high - k);
    }
    start(first);
    const Vector here = hn::LoadU(d, arc + first);
    for (std::ptrdiff_t j = first - before; j <= first + after; ++j) {
      const Vector distance = hn::Sub(hn::LoadU(d, arc + j), here);
      const Vector t =
          hn::Max(hn::Sub(one, hn::Mul(hn::Mul(distance, distance), inverse_square)), hn::Zero(d));
      add(j, hn::Mul(hn::LoadU(d, ring.weight + j), hn::Mul(t, t)));
    }
    finish(first, lanes);
  }
}

HWY_INLINE void StoreLanes(Vector values, std::ptrdiff_t lanes, double* target) {
  const Lanes d;
  if (lanes == kLanes) {
    hn::StoreU(values, d, target);
  } else {
    HWY_ALIGN double all[kLanes];
    hn::Store(values, d, all);
    std::copy(all, all + lanes, target);
  }
}

template <bool kByAngle>
void SumNormals(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
  const Lanes d;
  Vector own_x, own_y, sum_x, sum_y;
  ForEachWindow(
      ring, begin, end, reach,
      [&](std::ptrdiff_t first) HWY_ATTR {
        own_x = hn::LoadU(d, ring.normal_x + first);
        own_y = hn::LoadU(d, ring.normal_y + first);
        sum_x = sum_y = hn::Zero(d);
      },
      [&](std::ptrdiff_t j, Vector w) HWY_ATTR {
        const Vector x = hn::LoadU(d, ring.normal_x + j);
        const Vector y = hn::LoadU(d, ring.normal_y + j);
        if constexpr (kByAngle) w = hn::Mul(w, AngleWeight(Dot(own_x, own_y, x, y)));
        sum_x = hn::Add(sum_x, hn::Mul(w, x));
        sum_y = hn::Add(sum_y, hn::Mul(w, y));
      },
      [&](std::ptrdiff_t first, std::ptrdiff_t lanes) HWY_ATTR {
        const Vector square = Dot(sum_x, sum_y, sum_x, sum_y);
        const Vector length = hn::Sqrt(square);
        const auto is_weak = hn::Lt(square, hn::Set(d, kWeakGradientSquare * kWeakGradientSquare));
        StoreLanes(hn::IfThenElse(is_weak, own_x, hn::Div(sum_x, length)), lanes,
                   ring.next_x + first);
        StoreLanes(hn::IfThenElse(is_weak, own_y, hn::Div(sum_y, length)), lanes,
                   ring.next_y + first);
      });
}

void MeanNormals(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle) {
  if (by_angle) {
    SumNormals<true>(ring, begin, end, reach);
  } else {
    SumNormals<false>(ring, begin, end, reach);
  }
}

void MeanCurvature(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach) {
  const Lanes d;
  Vector x, y, normal_x, normal_y, turn, square;
  ForEachWindow(
      ring, begin, end, reach,
      [&](std::ptrdiff_t first) HWY_ATTR {
        x = hn::LoadU(d, ring.x + first);
        y = hn::LoadU(d, ring.y + first);
        normal_x = hn::LoadU(d, ring.normal_x + first);
        normal_y = hn::LoadU(d, ring.normal_y + first);
        turn = square = hn::Zero(d);
      },
      [&](std::ptrdiff_t j, Vector w) HWY_ATTR {
        // The tangent is (-normal_y, normal_x).
        const auto along_tangent = [&](Vector to_x, Vector to_y) HWY_ATTR {
          return hn::Sub(hn::Mul(to_y, normal_x), hn::Mul(to_x, normal_y));
        };
        const Vector along = along_tangent(hn::Sub(hn::LoadU(d, ring.x + j), x),
                                           hn::Sub(hn::LoadU(d, ring.y + j), y));
        const Vector turned = along_tangent(hn::Sub(hn::LoadU(d, ring.normal_x + j), normal_x),
                                            hn::Sub(hn::LoadU(d, ring.normal_y + j), normal_y));
        const Vector weighted = hn::Mul(w, along);
        turn = hn::Add(turn, hn::Mul(weighted, turned));
        square = hn::Add(square, hn::Mul(weighted, along));
      },
      [&](std::ptrdiff_t first, std::ptrdiff_t lanes) HWY_ATTR {
        const auto is_known = hn::Gt(square, hn::Zero(d));
        StoreLanes(hn::IfThenElseZero(is_known, hn::Div(turn, square)), lanes, ring.shift + first);
      });
}

void MeanShift(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
  const Lanes d;
  Vector x, y, normal_x, normal_y, base, sum, weight;
  ForEachWindow(
      ring, begin, end, reach,
      [&](std::ptrdiff_t first) HWY_ATTR {
        x = hn::LoadU(d, ring.x + first);
        y = hn::LoadU(d, ring.y + first);
        normal_x = hn::LoadU(d, ring.normal_x + first);
        normal_y = hn::LoadU(d, ring.normal_y + first);
        base = hn::LoadU(d, ring.base + first);
        sum = weight = hn::Zero(d);
      },
      [&](std::ptrdiff_t j, Vector w) HWY_ATTR {
        const Vector near_x = hn::LoadU(d, ring.normal_x + j);
        const Vector near_y = hn::LoadU(d, ring.normal_y + j);
        w = hn::Mul(w, AngleWeight(Dot(normal_x, normal_y, near_x, near_y)));
        const Vector chord_x = hn::Sub(hn::LoadU(d, ring.x + j), x);
        const Vector chord_y = hn::Sub(hn::LoadU(d, ring.y + j), y);
        const Vector offset = hn::Mul(hn::Add(Dot(normal_x, normal_y, chord_x, chord_y),
                                              Dot(near_x, near_y, chord_x, chord_y)),
                                      hn::Set(d, 0.5));
        const Vector raised = hn::Sub(hn::LoadU(d, ring.base + j), base);
        sum = hn::Add(sum, hn::Mul(w, hn::Add(offset, raised)));
        weight = hn::Add(weight, w);
      },
      [&](std::ptrdiff_t first, std::ptrdiff_t lanes) HWY_ATTR {
        const auto is_known = hn::Gt(weight, hn::Zero(d));
        const Vector mean = hn::IfThenElseZero(is_known, hn::Div(sum, weight));
        StoreLanes(hn::Add(base, mean), lanes, ring.shift + first);
      });
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(MeanNormals);
HWY_EXPORT(MeanCurvature);
HWY_EXPORT(MeanShift);

void MeanNormals(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle) {
  HWY_DYNAMIC_DISPATCH(MeanNormals)(ring, begin, end, reach, by_angle);
}

void MeanCurvature(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach) {
  HWY_DYNAMIC_DISPATCH(MeanCurvature)(ring, begin, end, reach);
}

void MeanShift(const UnrolledRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
  HWY_DYNAMIC_DISPATCH(MeanShift)(ring, begin, end, reach);
}

}  // namespace partiemc
#endif  // HWY_ONCE
