#include "space_vertices/window_sums.h"

#include <algorithm>
#include <array>
#include <bit>

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "space_vertices/window_sums.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc::space {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kAtOnce = 8;  // Loops of a byte of a window.
using Lanes = hn::CappedTag<float, kAtOnce>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

template <int kQuantities>
using Partial = std::array<std::array<float, kAtOnce>, kQuantities>;

template <int kQuantities>
double TotalOf(const Partial<kQuantities>& sums, int quantity) {
  const auto& part = sums[quantity];
  return ((double{part[0]} + double{part[4]}) + (double{part[2]} + double{part[6]})) +
         ((double{part[1]} + double{part[5]}) + (double{part[3]} + double{part[7]}));
}

// Calls visit(index, byte) for the bytes of a window that are not 0. Finds them 64 at a time,
// because a branch for each byte is hard to predict.
template <class Visit>
HWY_INLINE void ForEachByte(std::span<const std::uint32_t> words, Visit visit) {
  constexpr std::size_t kPerWord = LoopWindows::kWordBits / kAtOnce, kWordsAtOnce = 64 / kPerWord;
  for (std::size_t first = 0; first < words.size(); first += kWordsAtOnce) {
    std::uint64_t not_zero = 0;
    for (std::size_t k = first; k < std::min(first + kWordsAtOnce, words.size()); ++k) {
      // Sets the highest bit of each byte that is not 0. Then moves these bits side by side.
      const std::uint32_t low = (words[k] & 0x7f7f7f7fu) + 0x7f7f7f7fu;
      const std::uint32_t any = ((low | words[k]) & 0x80808080u) >> 7;
      not_zero |= std::uint64_t{any * 0x10204080u >> 28} << kPerWord * (k - first);
    }
    for (; not_zero != 0; not_zero &= not_zero - 1) {
      const std::size_t byte =
          kPerWord * first + static_cast<std::size_t>(std::countr_zero(not_zero));
      visit(byte, static_cast<std::uint8_t>(words[byte / kPerWord] >> kAtOnce * (byte % kPerWord)));
    }
  }
}

// Smaller cosines count as 0. Their 32nd power is below 1.3e-29, and denormal floats, with which
// processors take a hundred times as long, begin at 1.2e-38.
constexpr float kLeastCosine = .125f;

// Pairs of the loop i of a window and a vector of near loops j.
struct Pairs {
  Vector x, y, z;                         // c_j - c_i
  Vector normal_x, normal_y, normal_z;    // n_j
  Vector self_x, self_y, self_z, weight;  // n_i, w

  HWY_INLINE Vector AlongSelf() const {
    return hn::Add(hn::Add(hn::Mul(x, self_x), hn::Mul(y, self_y)), hn::Mul(z, self_z));
  }
  HWY_INLINE Vector Cosine() const {
    return hn::Add(hn::Add(hn::Mul(normal_x, self_x), hn::Mul(normal_y, self_y)),
                   hn::Mul(normal_z, self_z));
  }
  HWY_INLINE void StopAtEdges() {
    const Lanes d;
    const Vector cosine = Cosine();
    Vector power = hn::IfThenElseZero(hn::Gt(cosine, hn::Set(d, kLeastCosine)), cosine);
    for (int k = 0; k < 5; ++k) power = hn::Mul(power, power);
    weight = hn::Mul(weight, power);
  }
};

// Calls add(pairs, k) for the vectors whose terms belong to the partial sums [lane, lane + kLanes).
// k is the first near loop of the vector.
template <class Add>
HWY_INLINE void ForEachPair(const NearLoops& loops, const Window& window, int lane, Add add) {
  const Lanes d;
  const std::size_t self = window.self;
  const Vector x = hn::Set(d, loops.x[self]), y = hn::Set(d, loops.y[self]),
               z = hn::Set(d, loops.z[self]);
  const Vector inverse = hn::Set(d, window.inverse_square), one = hn::Set(d, 1.0f);
  Pairs pairs;
  pairs.self_x = hn::Set(d, loops.normal_x[self]);
  pairs.self_y = hn::Set(d, loops.normal_y[self]);
  pairs.self_z = hn::Set(d, loops.normal_z[self]);
  ForEachByte(window.bits, [&](std::size_t byte, std::uint8_t all) HWY_ATTR {
    // LoadMaskBits may read eight bytes.
    const std::array<std::uint8_t, 8> bits{static_cast<std::uint8_t>(all >> lane)};
    const std::size_t k = byte * kAtOnce + static_cast<std::size_t>(lane);
    pairs.x = hn::Sub(hn::Load(d, loops.x.data() + k), x);
    pairs.y = hn::Sub(hn::Load(d, loops.y.data() + k), y);
    pairs.z = hn::Sub(hn::Load(d, loops.z.data() + k), z);
    const Vector square = hn::Add(hn::Add(hn::Mul(pairs.x, pairs.x), hn::Mul(pairs.y, pairs.y)),
                                  hn::Mul(pairs.z, pairs.z));
    const Vector t = hn::Max(hn::Zero(d), hn::Sub(one, hn::Mul(square, inverse)));
    pairs.normal_x = hn::Load(d, loops.normal_x.data() + k);
    pairs.normal_y = hn::Load(d, loops.normal_y.data() + k);
    pairs.normal_z = hn::Load(d, loops.normal_z.data() + k);
    pairs.weight = hn::IfThenElseZero(hn::LoadMaskBits(d, bits.data()),
                                      hn::Mul(hn::Mul(t, t), hn::Load(d, loops.area.data() + k)));
    add(pairs, k);
  });
}

void FindWithin(const NearPlaces& places, std::size_t count, const WindowEnds& ends,
                std::uint64_t* within) {
  const Lanes d;
  for (std::size_t k = 0; k < count; ++k) {
    const Vector x = hn::Set(d, places.x[k]), y = hn::Set(d, places.y[k]),
                 z = hn::Set(d, places.z[k]);
    std::uint64_t found = 0;
    for (std::size_t window = 0; window < ends.count; window += kLanes) {
      const Vector dx = hn::Sub(x, hn::Load(d, places.x.data() + window));
      const Vector dy = hn::Sub(y, hn::Load(d, places.y.data() + window));
      const Vector dz = hn::Sub(z, hn::Load(d, places.z.data() + window));
      const Vector to = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      std::uint8_t part[8] = {};
      hn::StoreMaskBits(d, hn::Lt(to, hn::Load(d, ends.square.data() + window)), part);
      found |= std::uint64_t{part[0]} << window;
    }
    within[k] = found;
  }
}

Vec3 SumNormals(const NearLoops& loops, const Window& window, bool stops_at_edges) {
  const Lanes d;
  alignas(64) Partial<3> sums;
  for (int lane = 0; lane < kAtOnce; lane += kLanes) {
    Vector sx = hn::Zero(d), sy = hn::Zero(d), sz = hn::Zero(d);
    ForEachPair(loops, window, lane, [&](Pairs& pairs, std::size_t) HWY_ATTR {
      if (stops_at_edges) pairs.StopAtEdges();
      sx = hn::Add(sx, hn::Mul(pairs.weight, pairs.normal_x));
      sy = hn::Add(sy, hn::Mul(pairs.weight, pairs.normal_y));
      sz = hn::Add(sz, hn::Mul(pairs.weight, pairs.normal_z));
    });
    hn::Store(sx, d, sums[0].data() + lane);
    hn::Store(sy, d, sums[1].data() + lane);
    hn::Store(sz, d, sums[2].data() + lane);
  }
  return {TotalOf<3>(sums, 0), TotalOf<3>(sums, 1), TotalOf<3>(sums, 2)};
}

BendSums SumBends(const NearLoops& loops, const Window& window) {
  const Lanes d;
  alignas(64) Partial<2> sums;
  for (int lane = 0; lane < kAtOnce; lane += kLanes) {
    Vector turn = hn::Zero(d), way = hn::Zero(d);
    ForEachPair(loops, window, lane, [&](const Pairs& pairs, std::size_t) HWY_ATTR {
      const Vector along = pairs.AlongSelf();
      const Vector x = hn::Sub(pairs.x, hn::Mul(along, pairs.self_x));
      const Vector y = hn::Sub(pairs.y, hn::Mul(along, pairs.self_y));
      const Vector z = hn::Sub(pairs.z, hn::Mul(along, pairs.self_z));
      const Vector turned = hn::Add(hn::Add(hn::Mul(hn::Sub(pairs.normal_x, pairs.self_x), x),
                                            hn::Mul(hn::Sub(pairs.normal_y, pairs.self_y), y)),
                                    hn::Mul(hn::Sub(pairs.normal_z, pairs.self_z), z));
      const Vector square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
      turn = hn::Add(turn, hn::Mul(pairs.weight, turned));
      way = hn::Add(way, hn::Mul(pairs.weight, square));
    });
    hn::Store(turn, d, sums[0].data() + lane);
    hn::Store(way, d, sums[1].data() + lane);
  }
  return {TotalOf<2>(sums, 0), TotalOf<2>(sums, 1)};
}

PlaneSums SumPlanes(const NearLoops& loops, const Window& window) {
  const Lanes d;
  const Vector half = hn::Set(d, .5f);
  alignas(64) Partial<2> sums;
  for (int lane = 0; lane < kAtOnce; lane += kLanes) {
    Vector height = hn::Zero(d), total = hn::Zero(d);
    ForEachPair(loops, window, lane, [&](Pairs& pairs, std::size_t k) HWY_ATTR {
      pairs.StopAtEdges();
      const Vector along =
          hn::Add(hn::Add(hn::Mul(pairs.x, pairs.normal_x), hn::Mul(pairs.y, pairs.normal_y)),
                  hn::Mul(pairs.z, pairs.normal_z));
      const Vector mean = hn::Mul(half, hn::Add(along, pairs.AlongSelf()));
      const Vector plane = hn::Add(mean, hn::Load(d, loops.base.data() + k));
      height = hn::Add(height, hn::Mul(pairs.weight, plane));
      total = hn::Add(total, pairs.weight);
    });
    hn::Store(height, d, sums[0].data() + lane);
    hn::Store(total, d, sums[1].data() + lane);
  }
  return {TotalOf<2>(sums, 0), TotalOf<2>(sums, 1)};
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc::space
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc::space {

HWY_EXPORT(FindWithin);
HWY_EXPORT(SumNormals);
HWY_EXPORT(SumBends);
HWY_EXPORT(SumPlanes);

void FindWithin(const NearPlaces& places, std::size_t count, const WindowEnds& ends,
                std::uint64_t* within) {
  HWY_DYNAMIC_DISPATCH(FindWithin)(places, count, ends, within);
}
Vec3 SumNormals(const NearLoops& loops, const Window& window, bool stops_at_edges) {
  return HWY_DYNAMIC_DISPATCH(SumNormals)(loops, window, stops_at_edges);
}
BendSums SumBends(const NearLoops& loops, const Window& window) {
  return HWY_DYNAMIC_DISPATCH(SumBends)(loops, window);
}
PlaneSums SumPlanes(const NearLoops& loops, const Window& window) {
  return HWY_DYNAMIC_DISPATCH(SumPlanes)(loops, window);
}

}  // namespace partiemc::space
#endif  // HWY_ONCE
