#include "space/point_sums.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "space/point_sums.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "base/compressor-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc::space {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, NearBlock::kLanes>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

// The property of each particle that sums use, besides its position.
enum class Own { kNothing, kWeight, kSize };

// D and t (level_set.h) of a vector of particles of a block.
template <bool kSized>
struct Offsets {
  Vector x, y, z, t, per_size;

  HWY_INLINE Offsets() = default;
  HWY_INLINE Offsets(const NearBlock& block, int k, Vector px, Vector py, Vector pz,
                     Vector inverse_square) {
    const Lanes d;
    x = hn::Sub(hn::LoadU(d, block.x.data() + k), px);
    y = hn::Sub(hn::LoadU(d, block.y.data() + k), py);
    z = hn::Sub(hn::LoadU(d, block.z.data() + k), pz);
    if constexpr (kSized) {
      per_size = hn::LoadU(d, block.per_size.data() + k);
      x = hn::Mul(x, per_size);
      y = hn::Mul(y, per_size);
      z = hn::Mul(z, per_size);
    }
    const Vector square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    t = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, inverse_square)));
  }
};

// Calls add(offsets, k) for each vector of particles whose terms belong to the partial sums [lane,
// lane + kLanes). k is the index of its first particle.
template <bool kSized, class Add>
HWY_INLINE void ForEachOffset(const NearBlock& block, const QueryPoint& point, float inverse_square,
                              int lane, Add add) {
  const Lanes d;
  const Vector px = hn::Set(d, point.x), py = hn::Set(d, point.y), pz = hn::Set(d, point.z);
  const Vector inverse = hn::Set(d, inverse_square);
  for (int k = lane; k < block.count; k += NearBlock::kLanes) {
    add(Offsets<kSized>(block, k, px, py, pz, inverse), k);
  }
}

// Partial sums [lane, lane + kLanes) in registers.
template <Own kOwn>
struct Moments {
  static constexpr bool kSized = kOwn == Own::kSize;
  Vector k0, kw, kx, ky, kz, xx, xy, xz, yy, yz, zz;

  HWY_INLINE Moments(const PartialMoments& sums, int lane) {
    const auto load = [&](int q)
                          HWY_ATTR { return hn::Load(Lanes(), sums.lanes[q].data() + lane); };
    k0 = load(0), kw = load(1), kx = load(2), ky = load(3), kz = load(4);
    xx = load(5), xy = load(6), xz = load(7), yy = load(8), yz = load(9), zz = load(10);
  }
  // `p`: the index of the first particle.
  HWY_INLINE void Add(const Offsets<kSized>& to, const NearBlock& block, int p) {
    const Vector k = hn::Mul(hn::Mul(to.t, to.t), to.t);
    k0 = hn::Add(k0, k);
    if constexpr (kOwn != Own::kNothing) {
      kw = hn::Add(kw, hn::Mul(k, hn::LoadU(Lanes(), block.weight.data() + p)));
    }
    const Vector x = hn::Mul(k, to.x), y = hn::Mul(k, to.y), z = hn::Mul(k, to.z);
    kx = hn::Add(kx, x);
    ky = hn::Add(ky, y);
    kz = hn::Add(kz, z);
    xx = hn::Add(xx, hn::Mul(x, to.x));
    xy = hn::Add(xy, hn::Mul(x, to.y));
    xz = hn::Add(xz, hn::Mul(x, to.z));
    yy = hn::Add(yy, hn::Mul(y, to.y));
    yz = hn::Add(yz, hn::Mul(y, to.z));
    zz = hn::Add(zz, hn::Mul(z, to.z));
  }
  HWY_INLINE void StoreTo(PartialMoments& sums, int lane) const {
    const Vector weighted = kOwn == Own::kNothing ? k0 : kw;
    const Vector all[] = {k0, weighted, kx, ky, kz, xx, xy, xz, yy, yz, zz};
    for (int q = 0; q < 11; ++q) hn::Store(all[q], Lanes(), sums.lanes[q].data() + lane);
  }
};

template <Own kOwn>
struct SlopesInLanes {
  static constexpr bool kSized = kOwn == Own::kSize;
  Vector sx, sy, sz, xx, xy, xz, yy, yz, zz, wx, wy, wz;

  HWY_INLINE SlopesInLanes(const PartialSlopes& sums, int lane) {
    const auto load = [&](int q)
                          HWY_ATTR { return hn::Load(Lanes(), sums.lanes[q].data() + lane); };
    sx = load(0), sy = load(1), sz = load(2);
    xx = load(3), xy = load(4), xz = load(5), yy = load(6), yz = load(7), zz = load(8);
    wx = load(9), wy = load(10), wz = load(11);
  }
  HWY_INLINE void Add(const Offsets<kSized>& to, const NearBlock& block, int p) {
    Vector square = hn::Mul(to.t, to.t);
    if constexpr (kSized) {
      wx = hn::Add(wx, hn::Mul(hn::Mul(square, to.t), to.per_size));
      square = hn::Mul(square, to.per_size);
    }
    const Vector x = hn::Mul(square, to.x), y = hn::Mul(square, to.y), z = hn::Mul(square, to.z);
    sx = hn::Add(sx, x);
    sy = hn::Add(sy, y);
    sz = hn::Add(sz, z);
    xx = hn::Add(xx, hn::Mul(x, to.x));
    xy = hn::Add(xy, hn::Mul(x, to.y));
    xz = hn::Add(xz, hn::Mul(x, to.z));
    yy = hn::Add(yy, hn::Mul(y, to.y));
    yz = hn::Add(yz, hn::Mul(y, to.z));
    zz = hn::Add(zz, hn::Mul(z, to.z));
    if constexpr (kOwn == Own::kWeight) {
      const Vector w = hn::LoadU(Lanes(), block.weight.data() + p);
      wx = hn::Add(wx, hn::Mul(w, x));
      wy = hn::Add(wy, hn::Mul(w, y));
      wz = hn::Add(wz, hn::Mul(w, z));
    }
  }
  HWY_INLINE void StoreTo(PartialSlopes& sums, int lane) const {
    constexpr bool kIsUniform = kOwn == Own::kNothing;
    const Vector all[] = {sx,
                          sy,
                          sz,
                          xx,
                          xy,
                          xz,
                          yy,
                          yz,
                          zz,
                          kIsUniform ? sx : wx,
                          kIsUniform ? sy : wy,
                          kIsUniform ? sz : wz};
    for (int q = 0; q < 12; ++q) hn::Store(all[q], Lanes(), sums.lanes[q].data() + lane);
  }
};

template <Own kOwn>
void AddMomentsOf(const NearBlock& block, const QueryPoint& point, float inverse_square,
                  PartialMoments& sums) {
  constexpr bool kSized = kOwn == Own::kSize;
  for (int lane = 0; lane < NearBlock::kLanes; lane += kLanes) {
    Moments<kOwn> moments(sums, lane);
    const auto add = [&](const Offsets<kSized>& to, int p) HWY_ATTR { moments.Add(to, block, p); };
    ForEachOffset<kSized>(block, point, inverse_square, lane, add);
    moments.StoreTo(sums, lane);
  }
}

// Many particles around a box do not reach a given point in it. Vectors with such particles only
// would add zeros, so they are left out.
template <Own kOwn>
void AddMomentsAndSlopesOf(const NearBlock& block, const QueryPoint& point, float inverse_square,
                           PartialMoments& moments, PartialSlopes& slopes) {
  constexpr bool kSized = kOwn == Own::kSize;
  const Lanes d;
  const Vector px = hn::Set(d, point.x), py = hn::Set(d, point.y), pz = hn::Set(d, point.z);
  const Vector inverse = hn::Set(d, inverse_square);
  NearBlock::PerParticle<int> from;
  alignas(64) NearBlock::PerParticle<float> x, y, z, t;
  int count = 0;
  for (int k = 0; k < block.count; k += NearBlock::kLanes) {
    bool is_near = false;
    for (int lane = 0; lane < NearBlock::kLanes; lane += kLanes) {
      const Offsets<kSized> to(block, k + lane, px, py, pz, inverse);
      hn::Store(to.x, d, x.data() + count + lane);
      hn::Store(to.y, d, y.data() + count + lane);
      hn::Store(to.z, d, z.data() + count + lane);
      hn::Store(to.t, d, t.data() + count + lane);
      is_near |= !hn::AllFalse(d, hn::Gt(to.t, hn::Zero(d)));
    }
    from[count / NearBlock::kLanes] = k;
    count += is_near ? NearBlock::kLanes : 0;
  }
  const auto for_each = [&](int lane, auto add) HWY_ATTR {
    for (int k = 0; k < count; k += NearBlock::kLanes) {
      const int p = from[k / NearBlock::kLanes] + lane;
      Offsets<kSized> to;
      to.x = hn::Load(d, x.data() + k + lane);
      to.y = hn::Load(d, y.data() + k + lane);
      to.z = hn::Load(d, z.data() + k + lane);
      to.t = hn::Load(d, t.data() + k + lane);
      if constexpr (kSized) to.per_size = hn::LoadU(d, block.per_size.data() + p);
      add(to, p);
    }
  };
  for (int lane = 0; lane < NearBlock::kLanes; lane += kLanes) {
    Moments<kOwn> of_moments(moments, lane);
    for_each(lane,
             [&](const Offsets<kSized>& to, int p) HWY_ATTR { of_moments.Add(to, block, p); });
    of_moments.StoreTo(moments, lane);
    SlopesInLanes<kOwn> of_slopes(slopes, lane);
    for_each(lane, [&](const Offsets<kSized>& to, int p) HWY_ATTR { of_slopes.Add(to, block, p); });
    of_slopes.StoreTo(slopes, lane);
  }
}

template <bool kSized>
void AddThirdsOf(const NearBlock& block, const QueryPoint& point, float inverse_square,
                 const Vec3& v, PartialThirds& sums) {
  const Lanes d;
  const Vector vx = hn::Set(d, static_cast<float>(v.x)), vy = hn::Set(d, static_cast<float>(v.y)),
               vz = hn::Set(d, static_cast<float>(v.z));
  for (int lane = 0; lane < NearBlock::kLanes; lane += kLanes) {
    const auto load = [&](int q) HWY_ATTR { return hn::Load(d, sums.lanes[q].data() + lane); };
    Vector sx = load(0), sy = load(1), sz = load(2), kv = load(3);
    const auto add = [&](const Offsets<kSized>& to, int) HWY_ATTR {
      const Vector along =
          hn::Mul(to.t, hn::Add(hn::Add(hn::Mul(vx, to.x), hn::Mul(vy, to.y)), hn::Mul(vz, to.z)));
      Vector square = hn::Mul(along, along);
      if constexpr (kSized) {
        kv = hn::Add(kv, hn::Mul(hn::Mul(hn::Mul(to.t, to.t), along), to.per_size));
        square = hn::Mul(square, to.per_size);
      }
      sx = hn::Add(sx, hn::Mul(square, to.x));
      sy = hn::Add(sy, hn::Mul(square, to.y));
      sz = hn::Add(sz, hn::Mul(square, to.z));
    };
    ForEachOffset<kSized>(block, point, inverse_square, lane, add);
    hn::Store(sx, d, sums.lanes[0].data() + lane);
    hn::Store(sy, d, sums.lanes[1].data() + lane);
    hn::Store(sz, d, sums.lanes[2].data() + lane);
    hn::Store(kv, d, sums.lanes[3].data() + lane);
  }
}

void AddMoments(const NearBlock& block, const QueryPoint& point, float inverse_square,
                PartialMoments& sums) {
  const auto add = block.has_sizes     ? AddMomentsOf<Own::kSize>
                   : block.has_weights ? AddMomentsOf<Own::kWeight>
                                       : AddMomentsOf<Own::kNothing>;
  add(block, point, inverse_square, sums);
}

void AddMomentsAndSlopes(const NearBlock& block, const QueryPoint& point, float inverse_square,
                         PartialMoments& moments, PartialSlopes& slopes) {
  const auto add = block.has_sizes     ? AddMomentsAndSlopesOf<Own::kSize>
                   : block.has_weights ? AddMomentsAndSlopesOf<Own::kWeight>
                                       : AddMomentsAndSlopesOf<Own::kNothing>;
  add(block, point, inverse_square, moments, slopes);
}

void AddThirds(const NearBlock& block, const QueryPoint& point, float inverse_square, const Vec3& v,
               PartialThirds& sums) {
  const auto add = block.has_sizes ? AddThirdsOf<true> : AddThirdsOf<false>;
  add(block, point, inverse_square, v, sums);
}

// `found` is a NearPart or a NearBlock.
template <class Region, class Found>
HWY_INLINE bool SelectReachingOf(const Region& region, const NearBox& box, float radius,
                                 Found& found) {
  constexpr bool kIsBlock = std::is_same_v<Found, NearBlock>;
  const Lanes d;
  found.count = 0;
  // The squared distance of coordinates from the box along an axis.
  const auto beyond = [&](Vector at, int axis) HWY_ATTR {
    const Vector below = hn::Sub(hn::Set(d, box.low[axis]), at);
    const Vector above = hn::Sub(at, hn::Set(d, box.high[axis]));
    const Vector by = hn::Max(hn::Zero(d), hn::Max(below, above));
    return hn::Mul(by, by);
  };
  for (int p = 0; p < region.count; p += kLanes) {
    const Vector x = hn::LoadU(d, region.x.data() + p), y = hn::LoadU(d, region.y.data() + p);
    const Vector z = hn::LoadU(d, region.z.data() + p), size = hn::LoadU(d, region.size.data() + p);
    const Vector reach = hn::Mul(size, hn::Set(d, radius));
    const Vector square = hn::Add(hn::Add(beyond(x, 0), beyond(y, 1)), beyond(z, 2));
    const auto is_in = hn::And(hn::Lt(square, hn::Mul(reach, reach)),
                               hn::FirstN(d, static_cast<std::size_t>(region.count - p)));
    const auto chosen = static_cast<int>(hn::CountTrue(d, is_in));
    if (chosen == 0) continue;
    // Stores write whole vectors. The padding of `found` has room for values beyond the count.
    if (found.count + chosen > Found::kCapacity) return false;
    const partiemc::HWY_NAMESPACE::CompressorOf<NearBlock::kLanes> compress(
        hn::RebindMask(hn::RebindToSigned<Lanes>(), is_in));
    const auto store = [&](auto& to, Vector values) HWY_ATTR {
      hn::StoreU(compress(d, values), d, to.data() + found.count);
    };
    store(found.x, x);
    store(found.y, y);
    store(found.z, z);
    if constexpr (kIsBlock) {
      store(found.weight, size);
      store(found.per_size, hn::Div(hn::Set(d, 1.0f), size));
    } else {
      store(found.size, size);
    }
    found.count += chosen;
  }
  return true;
}

bool SelectPart(const NearBrick& region, const NearBox& box, float radius, NearPart& part) {
  return SelectReachingOf(region, box, radius, part);
}

bool SelectBlock(const NearPart& region, const NearBox& box, float radius, NearBlock& block) {
  return SelectReachingOf(region, box, radius, block);
}

// The nodes [first, last] of a brick within the radius of a coordinate.
struct NodeRange {
  int first, last;

  HWY_INLINE NodeRange(float coordinate, float radius) {
    constexpr int kOffset = 128;  // Truncation then rounds down.
    first = std::max(static_cast<int>(coordinate - radius + kOffset) - kOffset + 1, 0);
    last = std::min(static_cast<int>(coordinate + radius + kOffset) - kOffset, kBrickSize - 1);
  }
};

// A vector has a row of nodes, a part of a row, or two rows.
using RowLanes = hn::CappedTag<float, 2 * kBrickSize>;
constexpr int kRowLanes = static_cast<int>(hn::MaxLanes(RowLanes()));
constexpr int kRowsAtOnce = std::max(1, kRowLanes / kBrickSize);

template <Own kOwn>
void AddDensityOf(const SpaceBins& bins, const NearRun& run, float kernel_radius, float* nodes) {
  const RowLanes d;
  alignas(64) constexpr float kColumnOf[] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
  alignas(64) constexpr float kRowOf[] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  float radius = kernel_radius;
  auto inverse = hn::Set(d, 1 / (radius * radius));
  for (std::uint32_t p = run.first; p < run.last; ++p) {
    if constexpr (kOwn == Own::kSize) {
      radius = kernel_radius * bins.size[p];
      inverse = hn::Set(d, 1 / (radius * radius));
    }
    const float x = bins.x[p] + run.shift_x;
    const float y = bins.y[p] + run.shift_y;
    const float z = bins.z[p] + run.shift_z;
    const NodeRange rows(y, radius), layers(z, radius);
    alignas(32) std::array<float, kBrickSize> dz_square;
    for (int lane = 0; lane < kBrickSize; lane += kLanes) {
      const Lanes of_layers;
      const Vector dz =
          hn::Sub(hn::Set(of_layers, z), hn::Iota(of_layers, static_cast<float>(lane)));
      hn::Store(hn::Mul(dz, dz), of_layers, dz_square.data() + lane);
    }
    for (int lane = 0; lane < kBrickSize; lane += kRowLanes) {
      const auto dx = hn::Sub(hn::Set(d, x), hn::Load(d, kColumnOf + lane));
      const auto column = hn::Sub(hn::Set(d, 1.0f), hn::Mul(hn::Mul(dx, dx), inverse));
      const auto row_of = hn::Load(d, kRowOf + lane);
      for (int j = rows.first & ~(kRowsAtOnce - 1); j <= rows.last; j += kRowsAtOnce) {
        const auto row = hn::Add(hn::Set(d, static_cast<float>(j)), row_of);
        const auto dy = hn::Sub(hn::Set(d, y), row);
        const auto dy_square = hn::Mul(dy, dy);
        for (int k = layers.first; k <= layers.last; ++k) {
          const auto across = hn::Add(dy_square, hn::Set(d, dz_square[k]));
          const auto t = hn::Max(hn::Zero(d), hn::Sub(column, hn::Mul(across, inverse)));
          float* const at = nodes + (k * kBrickSize + j) * kBrickSize + lane;
          auto kernel = hn::Mul(hn::Mul(t, t), t);
          if constexpr (kOwn == Own::kWeight) {
            kernel = hn::Mul(kernel, hn::Set(d, bins.weight[p]));
          }
          hn::Store(hn::Add(hn::Load(d, at), kernel), d, at);
        }
      }
    }
  }
}

void AddDensity(const SpaceBins& bins, const NearRun& run, float radius, float* nodes) {
  const auto add = !bins.size.empty()     ? AddDensityOf<Own::kSize>
                   : !bins.weight.empty() ? AddDensityOf<Own::kWeight>
                                          : AddDensityOf<Own::kNothing>;
  add(bins, run, radius, nodes);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc::space
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc::space {

HWY_EXPORT(AddMoments);
HWY_EXPORT(AddMomentsAndSlopes);
HWY_EXPORT(AddThirds);
HWY_EXPORT(AddDensity);
HWY_EXPORT(SelectBlock);
HWY_EXPORT(SelectPart);

void AddMoments(const NearBlock& block, const QueryPoint& point, float inverse_square,
                PartialMoments& sums) {
  HWY_DYNAMIC_DISPATCH(AddMoments)(block, point, inverse_square, sums);
}
void AddMomentsAndSlopes(const NearBlock& block, const QueryPoint& point, float inverse_square,
                         PartialMoments& moments, PartialSlopes& slopes) {
  HWY_DYNAMIC_DISPATCH(AddMomentsAndSlopes)(block, point, inverse_square, moments, slopes);
}
void AddThirds(const NearBlock& block, const QueryPoint& point, float inverse_square, const Vec3& v,
               PartialThirds& sums) {
  HWY_DYNAMIC_DISPATCH(AddThirds)(block, point, inverse_square, v, sums);
}
void AddDensity(const SpaceBins& bins, const NearRun& run, float radius, float* nodes) {
  HWY_DYNAMIC_DISPATCH(AddDensity)(bins, run, radius, nodes);
}

bool SelectReaching(const NearBrick& region, const NearBox& box, float radius, NearPart& part) {
  return HWY_DYNAMIC_DISPATCH(SelectPart)(region, box, radius, part);
}
bool SelectReaching(const NearPart& region, const NearBox& box, float radius, NearBlock& block) {
  const bool fits = HWY_DYNAMIC_DISPATCH(SelectBlock)(region, box, radius, block);
  block.has_sizes = true;
  block.Pad();
  return fits;
}

Sums TotalOf(const PartialMoments& sums, double weight) {
  const auto at = [&](int q) { return sums.Total(q); };
  return {
      at(0), weight * at(1), {at(2), at(3), at(4)}, {at(5), at(6), at(7), at(8), at(9), at(10)}};
}

Slopes TotalOf(const PartialSlopes& sums, double weight) {
  const auto at = [&](int q) { return sums.Total(q); };
  return {{at(0), at(1), at(2)},
          {at(3), at(4), at(5), at(6), at(7), at(8)},
          weight * Vec3{at(9), at(10), at(11)}};
}

Sums SizedTotalOf(const PartialMoments& sums, double weight) {
  Sums total = TotalOf(sums, 1);
  const double sizes = total.density;  // In the place of sum w k.
  total.density = weight * total.kernel;
  if (total.kernel > 0) total.size = sizes / total.kernel;
  return total;
}

Slopes SizedTotalOf(const PartialSlopes& sums, double weight, double kernel) {
  Slopes total = TotalOf(sums, 1);
  total.per_size = total.density.x / kernel;  // In the place of sum w t^2 D.
  total.density = weight * total.first;
  return total;
}

}  // namespace partiemc::space
#endif  // HWY_ONCE
