#include "vertices/ring_filters.h"

#include <algorithm>

#include "normals/normals.h"

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vertices/ring_filters.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 16>;
using Units = hn::RebindToSigned<Lanes>;
using Vector = hn::Vec<Lanes>;
constexpr auto kLanes = static_cast<std::ptrdiff_t>(hn::MaxLanes(Lanes()));
static_assert(kLanes < kWindowPadding, "windows end one vertex after all of their lanes have");

HWY_INLINE Vector Dot(Vector ax, Vector ay, Vector bx, Vector by) {
  return hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by));
}

// max(0, cosine)^16: 1 at 0 degrees, 0.1 at 30 degrees. Vertices beyond a corner hardly count.
HWY_INLINE Vector AngleWeight(Vector cosine) {
  Vector power = hn::Max(cosine, hn::Zero(Lanes()));
  for (int squaring = 0; squaring < 4; ++squaring) power = hn::Mul(power, power);
  return power;
}

// The vertices of one vector; `lanes` of them are valid.
struct Block {
  std::ptrdiff_t first, lanes;
};

// Differences `to` - `from` in cells, of coordinates in units.
HWY_INLINE Vector CellsBetween(hn::Vec<Units> from, const std::int32_t* to) {
  const Lanes d;
  const auto units = hn::Sub(hn::LoadU(Units(), to), from);
  return hn::Mul(hn::ConvertTo(d, units), hn::Set(d, static_cast<float>(1 / kRingUnitsPerCell)));
}

// Processes the vertices [begin, end) in blocks. For each block, calls start(first), with the first
// vertex of the block. Then calls add(j, w) for each offset j - first at which a vertex of the
// block has a neighbour in its window, and finish(block) at the end. Lane k of w is the weight of
// vertex j + k for vertex first + k, 0 beyond the window.
template <typename Start, typename Add, typename Finish>
HWY_INLINE void ForEachWindow(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                              double reach, Start start, Add add, Finish finish) {
  const Lanes d;
  const Vector one = hn::Set(d, 1.0f);
  const double reach_units = reach * kRingUnitsPerCell;
  const Vector inverse_square = hn::Set(d, static_cast<float>(1 / (reach_units * reach_units)));
  for (Block block{begin, kLanes}; block.first < end; block.first += kLanes) {
    block.lanes = std::min(kLanes, end - block.first);
    const auto in_block = hn::FirstN(d, static_cast<std::size_t>(block.lanes));
    const auto here = hn::LoadU(Units(), ring.arc + block.first);
    // 1 - d^2 / reach^2: positive inside the window only.
    const auto nearness_of = [&](std::ptrdiff_t j) HWY_ATTR {
      const auto units = hn::Sub(hn::LoadU(Units(), ring.arc + j), here);
      const Vector distance = hn::ConvertTo(d, units);
      return hn::Sub(one, hn::Mul(hn::Mul(distance, distance), inverse_square));
    };
    const auto add_near = [&](std::ptrdiff_t j, Vector nearness) HWY_ATTR {
      const Vector t = hn::Max(nearness, hn::Zero(d));
      add(j, hn::Mul(hn::LoadU(d, ring.weight + j), hn::Mul(t, t)));
    };
    start(block.first);
    add_near(block.first, one);
    const auto is_near = [&](Vector nearness) HWY_ATTR {
      return !hn::AllFalse(d, hn::And(hn::Gt(nearness, hn::Zero(d)), in_block));
    };
    // The two directions end separately: the margin on one side may end before the window on the
    // other side does.
    bool goes_before = true, goes_after = true;
    for (std::ptrdiff_t apart = 1; goes_before || goes_after; ++apart) {
      if (goes_before) {
        const Vector nearness = nearness_of(block.first - apart);
        goes_before = is_near(nearness);
        if (goes_before) add_near(block.first - apart, nearness);
      }
      if (goes_after) {
        const Vector nearness = nearness_of(block.first + apart);
        goes_after = is_near(nearness);
        if (goes_after) add_near(block.first + apart, nearness);
      }
    }
    finish(block);
  }
}

HWY_INLINE void StoreBlock(Vector values, const Block& block, float* target) {
  const Lanes d;
  if (block.lanes == kLanes) {
    hn::StoreU(values, d, target + block.first);
  } else {
    HWY_ALIGN float all[kLanes];
    hn::Store(values, d, all);
    std::copy(all, all + block.lanes, target + block.first);
  }
}

// Writes the length of the step after each vertex (LengthInUnits) to its `arc`.
void MeasureSteps(const PeriodicRing& ring) {
  const Lanes d;
  const Units d_units;
  // The last vector may extend into the margin.
  for (std::ptrdiff_t k = 0; k < ring.count; k += kLanes) {
    const auto along = [&](const std::int32_t* at) HWY_ATTR {
      return hn::ConvertTo(d, hn::Sub(hn::LoadU(d_units, at + k + 1), hn::LoadU(d_units, at + k)));
    };
    const Vector x = along(ring.x);
    const Vector y = along(ring.y);
    hn::StoreU(hn::ConvertTo(d_units, hn::Sqrt(Dot(x, y, x, y))), d_units, ring.arc + k);
  }
}

template <bool kByAngle>
void SumNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
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
      [&](const Block& block) HWY_ATTR {
        const Vector square = Dot(sum_x, sum_y, sum_x, sum_y);
        const Vector length = hn::Sqrt(square);
        const auto is_weak = hn::Lt(
            square, hn::Set(d, static_cast<float>(kWeakGradientSquare * kWeakGradientSquare)));
        StoreBlock(hn::IfThenElse(is_weak, own_x, hn::Div(sum_x, length)), block, ring.next_x);
        StoreBlock(hn::IfThenElse(is_weak, own_y, hn::Div(sum_y, length)), block, ring.next_y);
      });
}

void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle) {
  if (by_angle) {
    SumNormals<true>(ring, begin, end, reach);
  } else {
    SumNormals<false>(ring, begin, end, reach);
  }
}

void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach) {
  const Lanes d;
  hn::Vec<Units> x, y;
  Vector normal_x, normal_y, turn, square;
  ForEachWindow(
      ring, begin, end, reach,
      [&](std::ptrdiff_t first) HWY_ATTR {
        x = hn::LoadU(Units(), ring.x + first);
        y = hn::LoadU(Units(), ring.y + first);
        normal_x = hn::LoadU(d, ring.normal_x + first);
        normal_y = hn::LoadU(d, ring.normal_y + first);
        turn = square = hn::Zero(d);
      },
      [&](std::ptrdiff_t j, Vector w) HWY_ATTR {
        // The tangent is (-normal_y, normal_x).
        const auto along_tangent = [&](Vector to_x, Vector to_y) HWY_ATTR {
          return hn::Sub(hn::Mul(to_y, normal_x), hn::Mul(to_x, normal_y));
        };
        const Vector along =
            along_tangent(CellsBetween(x, ring.x + j), CellsBetween(y, ring.y + j));
        const Vector turned = along_tangent(hn::Sub(hn::LoadU(d, ring.normal_x + j), normal_x),
                                            hn::Sub(hn::LoadU(d, ring.normal_y + j), normal_y));
        const Vector weighted = hn::Mul(w, along);
        turn = hn::Add(turn, hn::Mul(weighted, turned));
        square = hn::Add(square, hn::Mul(weighted, along));
      },
      [&](const Block& block) HWY_ATTR {
        const auto is_known = hn::Gt(square, hn::Zero(d));
        StoreBlock(hn::IfThenElseZero(is_known, hn::Div(turn, square)), block, ring.shift);
      });
}

void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
  const Lanes d;
  hn::Vec<Units> x, y;
  Vector normal_x, normal_y, base, sum, weight;
  ForEachWindow(
      ring, begin, end, reach,
      [&](std::ptrdiff_t first) HWY_ATTR {
        x = hn::LoadU(Units(), ring.x + first);
        y = hn::LoadU(Units(), ring.y + first);
        normal_x = hn::LoadU(d, ring.normal_x + first);
        normal_y = hn::LoadU(d, ring.normal_y + first);
        base = hn::LoadU(d, ring.base + first);
        sum = weight = hn::Zero(d);
      },
      [&](std::ptrdiff_t j, Vector w) HWY_ATTR {
        const Vector near_x = hn::LoadU(d, ring.normal_x + j);
        const Vector near_y = hn::LoadU(d, ring.normal_y + j);
        w = hn::Mul(w, AngleWeight(Dot(normal_x, normal_y, near_x, near_y)));
        const Vector chord_x = CellsBetween(x, ring.x + j);
        const Vector chord_y = CellsBetween(y, ring.y + j);
        const Vector offset = hn::Mul(hn::Add(Dot(normal_x, normal_y, chord_x, chord_y),
                                              Dot(near_x, near_y, chord_x, chord_y)),
                                      hn::Set(d, 0.5f));
        const Vector raised = hn::Sub(hn::LoadU(d, ring.base + j), base);
        sum = hn::Add(sum, hn::Mul(w, hn::Add(offset, raised)));
        weight = hn::Add(weight, w);
      },
      [&](const Block& block) HWY_ATTR {
        const auto is_known = hn::Gt(weight, hn::Zero(d));
        const Vector mean = hn::IfThenElseZero(is_known, hn::Div(sum, weight));
        StoreBlock(hn::Add(base, mean), block, ring.shift);
      });
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(MeasureSteps);
HWY_EXPORT(MeanNormals);
HWY_EXPORT(MeanCurvature);
HWY_EXPORT(MeanShift);

void MeasureArc(const PeriodicRing& ring, std::span<const float> sizes) {
  HWY_DYNAMIC_DISPATCH(MeasureSteps)(ring);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    ring.arc[k] = LengthInSizes(ring.arc[k], sizes[k], sizes[k + 1 == sizes.size() ? 0 : k + 1]);
  }
  std::uint32_t length = 0;
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    const auto step = static_cast<std::uint32_t>(ring.arc[k]);
    ring.arc[k] = static_cast<std::int32_t>(length);
    length += step;
  }
  const auto moved = [&](std::int32_t arc, std::uint32_t by) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(arc) + by);
  };
  for (std::ptrdiff_t k = ring.count; k < ring.count + ring.margin; ++k) {
    ring.arc[k] = moved(ring.arc[k - ring.count], length);
  }
  for (std::ptrdiff_t k = -1; k >= -ring.margin; --k) {
    ring.arc[k] = moved(ring.arc[k + ring.count], 0 - length);
  }
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    ring.weight[k] = static_cast<float>(UnitsBetween(ring.arc[k - 1], ring.arc[k + 1])) *
                     static_cast<float>(0.5 / kRingUnitsPerCell);
  }
  ring.Repeat(ring.weight, 0, ring.count);
}

void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle) {
  HWY_DYNAMIC_DISPATCH(MeanNormals)(ring, begin, end, reach, by_angle);
}

void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach) {
  HWY_DYNAMIC_DISPATCH(MeanCurvature)(ring, begin, end, reach);
}

void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach) {
  HWY_DYNAMIC_DISPATCH(MeanShift)(ring, begin, end, reach);
}

}  // namespace partiemc
#endif  // HWY_ONCE
