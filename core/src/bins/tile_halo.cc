#include "bins/tile_halo.h"

#include <algorithm>
#include <array>
#include <cstddef>

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bins/tile_halo.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 16>;
using Bits = hn::RebindToUnsigned<Lanes>;
constexpr std::size_t kLanes = hn::MaxLanes(Lanes());

// Sets bit kStride * (d + 2) of a lane if the particle reaches the tile that is d tiles away along
// an axis.
template <int kStride>
HWY_INLINE hn::Vec<Bits> Along(hn::Vec<Lanes> at, float reach) {
  constexpr float kSize = kTileSize;
  const Lanes d;
  const Bits d_bits;
  const auto bit = [&](int k, hn::Mask<Lanes> is_reached) HWY_ATTR {
    return hn::IfThenElseZero(hn::RebindMask(d_bits, is_reached),
                              hn::Set(d_bits, std::uint32_t{1} << k * kStride));
  };
  const auto before = [&](float place) HWY_ATTR { return hn::Lt(at, hn::Set(d, place)); };
  const auto beyond = [&](float place) HWY_ATTR { return hn::Ge(at, hn::Set(d, place)); };
  const auto below = hn::Or(bit(0, before(reach - kSize)), bit(1, before(reach)));
  const auto above = hn::Or(bit(3, beyond(kSize - reach)), bit(4, beyond(2 * kSize - reach)));
  return hn::Or(hn::Or(below, above), hn::Set(d_bits, std::uint32_t{1} << 2 * kStride));
}

// The tiles that a particle reaches form a box. The bits of the box are the product of the bits
// along both axes.
HWY_INLINE hn::Vec<Bits> BoxesOf(const BinnedParticle* particles, float reach) {
  hn::Vec<Lanes> x, y, source;
  hn::LoadInterleaved3(Lanes(), &particles->x, x, y, source);
  return hn::Mul(Along<1>(x, reach), Along<5>(y, reach));
}

std::uint32_t TilesReached(const BinnedParticle* particles, std::size_t count, float reach) {
  const Bits d;
  auto reached = hn::Zero(d);
  std::array<BinnedParticle, kLanes> few;
  if (count < kLanes) {
    std::fill(std::copy_n(particles, count, few.begin()), few.end(), particles[0]);
    particles = few.data();
    count = kLanes;
  }
  for (std::size_t k = 0; k + kLanes <= count; k += kLanes) {
    reached = hn::Or(reached, BoxesOf(particles + k, reach));
  }
  // The last vector may overlap the one before it: visiting a particle twice changes nothing.
  reached = hn::Or(reached, BoxesOf(particles + count - kLanes, reach));
  std::array<std::uint32_t, kLanes> lanes;
  hn::StoreU(reached, d, lanes.data());
  std::uint32_t any = 0;
  for (const std::uint32_t lane : lanes) any |= lane;
  return any;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(TilesReached);

std::uint32_t TileHalo::Of(std::span<const BinnedParticle> particles) const {
  if (particles.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(TilesReached)(particles.data(), particles.size(), reach_);
}

}  // namespace partiemc
#endif  // HWY_ONCE
