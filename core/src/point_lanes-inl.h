// The vectors of doubles in which sums over particles at a point run: four partial sums, however
// wide the vectors of the processor are (point_kernels.h). Compiled once for each target, hence the
// guard that each of them turns.
#if defined(PARTIEMC_POINT_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_POINT_LANES_INL_H
#undef PARTIEMC_POINT_LANES_INL_H
#else
#define PARTIEMC_POINT_LANES_INL_H
#endif

#include <hwy/highway.h>

#include "point_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, kPointPadding>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));
// Vectors that make up the four partial sums.
constexpr int kParts = kPointPadding / kLanes;

HWY_INLINE Vector LoadDouble(const float* values) {
  return hn::PromoteTo(Lanes(), hn::LoadU(hn::Rebind<float, Lanes>(), values));
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
