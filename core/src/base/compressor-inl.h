// Moves the selected lanes of a vector to its front. Compiled once for each instruction set, so the
// include guard toggles.
#ifndef PARTIEMC_COMPRESSOR_ONCE
#define PARTIEMC_COMPRESSOR_ONCE

#include <array>
#include <cstddef>
#include <cstdint>

namespace partiemc {

// For each mask of eight lanes: the indices of its selected lanes, then zeros. For four lanes, the
// first 16 masks are used.
inline constexpr auto kChosenLanes = [] {
  std::array<std::array<std::uint8_t, 8>, 256> chosen{};
  for (unsigned mask = 0; mask < chosen.size(); ++mask) {
    std::size_t count = 0;
    for (std::uint8_t lane = 0; lane < 8; ++lane) {
      if ((mask >> lane & 1) != 0) chosen[mask][count++] = lane;
    }
  }
  return chosen;
}();

}  // namespace partiemc

#endif  // PARTIEMC_COMPRESSOR_ONCE

#if defined(PARTIEMC_COMPRESSOR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_COMPRESSOR_INL_H
#undef PARTIEMC_COMPRESSOR_INL_H
#else
#define PARTIEMC_COMPRESSOR_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Moves the lanes of a mask to the front, for vectors of up to kMostLanes 32-bit lanes. The class
// works in registers, because some processors are slow when they compress into memory. Below
// AVX-512, hn::Compress reads a table that GCC copies in each call.
template <std::size_t kMostLanes>
class CompressorOf {
 public:
  using Bits = hn::CappedTag<std::int32_t, kMostLanes>;

#if HWY_TARGET <= HWY_AVX3
  HWY_INLINE explicit CompressorOf(hn::Mask<Bits> mask) : mask_(mask) {}

  template <class D>
  HWY_INLINE hn::Vec<D> operator()(D d, hn::Vec<D> values) const {
    return hn::Compress(values, hn::RebindMask(d, mask_));
  }

 private:
  hn::Mask<Bits> mask_;
#else
  // The lane indices are looked up once per mask, so that several vectors can use them.
  HWY_INLINE explicit CompressorOf(hn::Mask<Bits> mask) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Bits(), mask, bits);
    const hn::Rebind<std::uint8_t, Bits> d_byte;
    lanes_ = hn::PromoteTo(Bits(), hn::LoadU(d_byte, kChosenLanes[bits[0]].data()));
  }

  template <class D>
  HWY_INLINE hn::Vec<D> operator()(D d, hn::Vec<D> values) const {
    return hn::TableLookupLanes(values, hn::IndicesFromVec(d, lanes_));
  }

 private:
  hn::Vec<Bits> lanes_;
#endif
};

using Compressor = CompressorOf<16>;

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
