// The level set and its gradient at points as functions of sums over particles
// (level_set_formula.h), in SIMD vectors of doubles with one lane for each point. Compiled once for
// each instruction set, so the include guard toggles.
#if defined(PARTIEMC_POINT_FORMULA_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_POINT_FORMULA_INL_H
#undef PARTIEMC_POINT_FORMULA_INL_H
#else
#define PARTIEMC_POINT_FORMULA_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "crossings/crossings.h"
#include "field/level_set_formula.h"
#include "frame/scale.h"
#include "sampler/point_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Sums over particles i. With d = x_i - x and t = 1 - d^2 / R^2, the kernel is k = t^3, and
// dk / da = 6 t^2 d_a / R^2. The sums leave out the factor 6 / R^2. a and b are x or y. With
// uniform weights, the weighted sums follow from the others. With sizes q, d = (x_i - x) / q, and
// each dk / da has a factor 1 / q.
enum Channel {
  kKernel,  // k
  kMomentX,
  kMomentY,  // k d_a
  kSlopeX,
  kSlopeY,  // dk / da
  kKxx,
  kKxy,
  kKyy,  // k d_a d_b
  kXx,
  kXy,
  kYy,  // (dk / da) d_b, the same for a and b exchanged
  kSums
};
enum WeightedChannel { kDensity = kSums, kDensityX, kDensityY, kWeightedSums };
// k q and k / q.
enum SizedChannel { kSize = kSums, kPerSize, kSizedSums };
// (dk / da) d_b d_c, symmetric in a, b, c, and k d_a / q. Needed only where the gap term decides F.
enum ThirdChannel { kXxx, kXxy, kXyy, kYyy, kPerSizeX, kPerSizeY, kThirdSums };

// The number of channels for particles with a factor.
template <Factor kFactor>
constexpr int kChannelsOf = kFactor == Factor::kWeight ? int{kWeightedSums}
                            : kFactor == Factor::kSize ? int{kSizedSums}
                                                       : int{kSums};

template <Factor kFactor>
class PointFormula {
 public:
  // Indexed by channel and point.
  using Totals = double[kChannelsOf<kFactor>][PointSamples::kCapacity];
  // Points per vector.
  static constexpr std::size_t kLanes = hn::MaxLanes(hn::CappedTag<double, 8>());

  HWY_INLINE explicit PointFormula(const Scale& scale)
      : scale_(scale), inverse_square_(1 / (scale.kernel_radius * scale.kernel_radius)) {}

  // Sets the samples at the first `count` points, and at some more to fill vectors. Returns a mask:
  // bit k is set if the gap term decides F at point k. The gradient there is wrong; GapGradient
  // computes it.
  HWY_INLINE std::uint64_t operator()(const Totals& totals, std::size_t count,
                                      PointSamples& samples) const {
    std::uint64_t gaps = 0;
    for (std::size_t at = 0; at < count; at += kLanes) {
      gaps |= std::uint64_t{Sample(totals, at, samples)} << at;
    }
    return gaps & ((std::uint64_t{1} << count) - 1);
  }

  // The gradient of the gap term at point number `point`. `third`: the sums of ThirdChannel at this
  // point.
  Point GapGradient(const Totals& totals, const double (&third)[kThirdSums],
                    std::size_t point) const {
    const auto sum = [&](int channel) { return totals[channel][point]; };
    const double slope = 6 * inverse_square_;
    const double share = inverse_square_ / sum(kKernel);
    const double xx = sum(kKxx) * share, xy = sum(kKxy) * share, yy = sum(kKyy) * share;
    const double spread = LargerEigenvalue(xx, xy, yy);
    // M = (xx, xy; xy, yy) has the eigenvalues s > s', and e e^T = (M - s' I) / (s - s') for the
    // eigenvector e of s. If both are equal, any direction is an eigenvector.
    const double gap = 2 * spread - (xx + yy);
    const double exx = gap > 0 ? (spread - yy) / gap : 0.5;
    const double exy = gap > 0 ? xy / gap : 0;
    const double eyy = 1 - exx;
    // ds = e . dM e. M is a ratio of sums; d_a decreases by 1 / q as x increases by 1.
    const auto along = [&](double dxx, double dxy, double dyy, double kernel_slope) {
      return ((exx * dxx + 2 * exy * dxy + eyy * dyy) * share -
              spread * kernel_slope / sum(kKernel)) *
             scale_.gap_slope;
    };
    const double moment_x = kSized ? third[kPerSizeX] : sum(kMomentX);
    const double moment_y = kSized ? third[kPerSizeY] : sum(kMomentY);
    const double xxy = slope * third[kXxy], xyy = slope * third[kXyy];
    const Point gradient{
        along(slope * third[kXxx] - 2 * moment_x, xxy - moment_y, xyy, slope * sum(kSlopeX)),
        along(xxy, xyy - moment_x, slope * third[kYyy] - 2 * moment_y, slope * sum(kSlopeY))};
    if constexpr (!kSized) return gradient;
    const double size = sum(kSize) / sum(kKernel);
    return {size * gradient.x, size * gradient.y};
  }

 private:
  using Doubles = hn::CappedTag<double, 8>;
  using Vector = hn::Vec<Doubles>;
  static constexpr bool kSized = kFactor == Factor::kSize;

  static HWY_INLINE Vector Constant(double value) { return hn::Set(Doubles(), value); }

  static HWY_INLINE Vector Length(Vector x, Vector y) {
    return hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y)));
  }

  // The local sizes at the points from `at` on; not defined without support. `share`: 1 / sum k.
  static HWY_INLINE Vector SizeAt([[maybe_unused]] const Totals& totals,
                                  [[maybe_unused]] std::size_t at, [[maybe_unused]] Vector share) {
    if constexpr (kSized) return hn::Mul(hn::Load(Doubles(), totals[kSize] + at), share);
    return Constant(1);
  }

  // Sets the samples at kLanes points from `at` on. Bit k of the result: the gap term decides F at
  // point at + k.
  HWY_INLINE std::uint8_t Sample(const Totals& totals, std::size_t at,
                                 PointSamples& samples) const {
    const Doubles d;
    const auto load = [&](int channel) HWY_ATTR { return hn::Load(d, totals[channel] + at); };
    const Vector zero = hn::Zero(d);
    const Vector half = Constant(0.5);
    const Vector slope = Constant(6 * inverse_square_);
    const Vector kernel = load(kKernel);
    const auto has_support = hn::Gt(kernel, zero);
    const Vector share = hn::Div(Constant(1), kernel);
    const Vector mean_x = hn::Mul(load(kMomentX), share);
    const Vector mean_y = hn::Mul(load(kMomentY), share);
    const Vector distance = Length(mean_x, mean_y);
    const Vector phi = hn::Sub(distance, Constant(scale_.reference_radius));

    // grad |v| with v = x - xbar = -mean and d xbar_a / dx_b = (sum k_b (d_a - mean_a)) / sum k.
    const Vector slope_x = hn::Mul(slope, load(kSlopeX));
    const Vector slope_y = hn::Mul(slope, load(kSlopeY));
    const auto jacobian = [&](int channel, Vector mean, Vector along) HWY_ATTR {
      return hn::Mul(hn::Sub(hn::Mul(slope, load(channel)), hn::Mul(mean, along)), share);
    };
    const Vector unit_x = hn::Div(mean_x, distance);
    const Vector unit_y = hn::Div(mean_y, distance);
    const auto slope_of_phi = [&](Vector jx, Vector jy, Vector unit) HWY_ATTR {
      if constexpr (kSized) unit = hn::Mul(unit, hn::Mul(load(kPerSize), share));
      const Vector along = hn::Sub(hn::Add(hn::Mul(unit_x, jx), hn::Mul(unit_y, jy)), unit);
      return hn::IfThenElseZero(hn::Gt(distance, zero), along);
    };
    const Vector phi_x =
        slope_of_phi(jacobian(kXx, mean_x, slope_x), jacobian(kXy, mean_y, slope_x), unit_x);
    const Vector phi_y =
        slope_of_phi(jacobian(kXy, mean_x, slope_y), jacobian(kYy, mean_y, slope_y), unit_y);

    const Vector spread_share = hn::Div(Constant(inverse_square_), kernel);
    const Vector xx = hn::Mul(load(kKxx), spread_share);
    const Vector xy = hn::Mul(load(kKxy), spread_share);
    const Vector yy = hn::Mul(load(kKyy), spread_share);
    const Vector spread =
        hn::Add(hn::Mul(hn::Add(xx, yy), half), Length(hn::Mul(hn::Sub(xx, yy), half), xy));

    const Vector w = Constant(scale_.uniform_weight);
    const auto weighted = [&](int weighted_channel, int channel) HWY_ATTR {
      return kFactor == Factor::kWeight ? load(weighted_channel) : hn::Mul(w, load(channel));
    };
    const Vector density = weighted(kDensity, kKernel);
    const Vector guard_slope = Constant(scale_.guard_slope);
    const Vector guard = hn::Mul(hn::Sub(Constant(scale_.guard), density), guard_slope);
    const Vector gap =
        hn::Mul(hn::Sub(spread, Constant(scale_.gap_spread)), Constant(scale_.gap_slope));
    const Vector saturation = hn::Mul(hn::Sub(Constant(scale_.saturation), density), guard_slope);
    const Vector value = hn::Min(hn::Max(hn::Max(phi, guard), gap), saturation);
    const auto is_phi = hn::Eq(value, phi);
    const auto is_gap = hn::And(hn::AndNot(is_phi, hn::Eq(value, gap)), has_support);
    // Guard and saturation have the same gradient.
    const auto gradient = [&](Vector phi_along, int weighted_channel, int channel) HWY_ATTR {
      const Vector along = hn::Mul(slope, weighted(weighted_channel, channel));
      return hn::IfThenElse(is_phi, phi_along, hn::Neg(hn::Mul(along, guard_slope)));
    };

    const Vector size = SizeAt(totals, at, share);
    // Scales lengths and gradients from size 1 to the local size.
    const auto sized = [&](Vector length) HWY_ATTR {
      if constexpr (kSized) return hn::Mul(length, size);
      return length;
    };
    const auto store = [&](Vector sample, PointSamples::PerPoint& to) HWY_ATTR {
      hn::StoreU(hn::IfThenElseZero(has_support, sample), d, to.data() + at);
    };
    const auto store_or = [&](Vector sample, double without, PointSamples::PerPoint& to) HWY_ATTR {
      hn::StoreU(hn::IfThenElse(has_support, sample, Constant(without)), d, to.data() + at);
    };
    store(kernel, samples.kernel);
    store(density, samples.density);
    store(sized(mean_x), samples.mean_x);
    store(sized(mean_y), samples.mean_y);
    store(sized(phi_x), samples.phi_x);
    store(sized(phi_y), samples.phi_y);
    store(spread, samples.spread);
    store(sized(gradient(phi_x, kDensityX, kSlopeX)), samples.gradient_x);
    store(sized(gradient(phi_y, kDensityY, kSlopeY)), samples.gradient_y);
    store_or(size, 1, samples.size);
    store_or(sized(phi), scale_.kernel_radius - scale_.reference_radius, samples.phi);
    store_or(sized(value), VoidValue(scale_), samples.value);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, is_gap, bits);
    return bits[0];
  }

  const Scale& scale_;
  const double inverse_square_;
};

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
