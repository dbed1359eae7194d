#include "tile_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tile_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernel_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

// The nodes of `among` that a kernel reaches.
HWY_INLINE NodeRange NodesReached(float centre, float radius, NodeRange among) {
  return {std::max(NodeAfter(centre - radius), among.first),
          std::min(NodeAfter(centre + radius) - 1, among.last)};
}

template <bool kWeighted>
void ScatterNearKernelsOf(const NearEntries& near, const float* weight, float radius,
                          NodeSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  for (int e = 0; e < near.count; ++e) {
    const NodeRange columns = NodesReached(near.x[e], radius, kAllNodes);
    const NodeRange rows = NodesReached(near.y[e], radius, kAllNodes);
    const float of = kWeighted ? weight[near.entry[e]] : 1.0f;
    ForEachVector(
        near.x[e], near.y[e], columns, rows, inverse_square,
        [&](int column, int row, const ColumnTerms& terms, Vector, Vector row_term) HWY_ATTR {
          AddRow<kWeighted>(row_term, terms.term, of, sums.data() + SumIndex(column, row));
        });
  }
}

void ScatterNearKernels(const NearEntries& near, const float* weight, float radius,
                        NodeSums& sums) {
  weight != nullptr ? ScatterNearKernelsOf<true>(near, weight, radius, sums)
                    : ScatterNearKernelsOf<false>(near, weight, radius, sums);
}

HWY_INLINE std::uint32_t BitsOf(hn::Mask<Lanes> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Lanes(), mask, bytes);
  return bytes[0];
}

void ClassifyNodes(float weight, const Scale& scale, NodeRange rows, float* values, BitRows& inside,
                   BitRows& open) {
  const Lanes d;
  const Vector guard = hn::Set(d, static_cast<float>(scale.guard));
  const Vector saturation = hn::Set(d, static_cast<float>(scale.saturation));
  const Vector slope = hn::Set(d, static_cast<float>(scale.guard_slope));
  const Vector void_value = hn::Set(d, static_cast<float>(scale.VoidValue()));
  for (int j = rows.first; j <= rows.last; ++j) {
    std::uint32_t inside_row = 0, open_row = 0;
    for (int i = 0; i < kTileSize; i += kLanes) {
      const Vector sum = hn::LoadU(d, values + j * kTileSize + i);
      const Vector f = hn::Mul(hn::Set(d, weight), sum);
      const auto is_inside = hn::Gt(f, saturation);
      const auto is_open = hn::AndNot(is_inside, hn::Gt(f, guard));
      inside_row |= BitsOf(is_inside) << i;
      open_row |= BitsOf(is_open) << i;
      const Vector branch = hn::IfThenElse(is_inside, saturation, guard);
      const Vector value = hn::Mul(hn::Sub(branch, f), slope);
      const Vector decided = hn::IfThenElse(hn::Eq(f, hn::Zero(d)), void_value, value);
      hn::StoreU(hn::IfThenElse(is_open, sum, decided), d, values + j * kTileSize + i);
    }
    inside[j] = inside_row;
    open[j] = open_row;
  }
}

// The branches of F that the density decides.
struct DensityBranches {
  Vector guard, saturation;
};

// LevelSetValue in vectors, of what is known of nodes.
class NodeFormula {
 public:
  HWY_INLINE NodeFormula(const AskedNodes& asked, float weight, const Scale& scale)
      : asked_(asked),
        weight_(hn::Set(d_, weight)),
        guard_(Constant(scale.guard)),
        saturation_(Constant(scale.saturation)),
        slope_(Constant(scale.guard_slope)),
        gap_spread_(Constant(scale.gap_spread)),
        gap_slope_(Constant(scale.gap_slope)),
        reference_radius_(Constant(scale.reference_radius)),
        void_value_(Constant(scale.VoidValue())),
        inverse_square_(Constant(1 / (scale.kernel_radius * scale.kernel_radius))) {}

  // F at the nodes from `at` on in the sums, which have `value` so far.
  HWY_INLINE Vector operator()(Vector value, const MomentSums& sums, int at) const {
    const auto load = [&](const NodeSums& of) HWY_ATTR { return hn::LoadU(d_, of.data() + at); };
    const Vector k = asked_.has_kernel_sums ? value : load(sums.kernel);
    const Vector inverse = hn::Div(hn::Set(d_, 1.0f), k);
    const Vector mean_x = hn::Mul(load(sums.moment_x), inverse);
    const Vector mean_y = hn::Mul(load(sums.moment_y), inverse);
    const Vector phi = hn::Sub(Length(mean_x, mean_y), reference_radius_);
    const Vector share = hn::Mul(inverse_square_, inverse);
    const Vector xx = hn::Mul(load(sums.xx), share);
    const Vector xy = hn::Mul(load(sums.xy), share);
    const Vector yy = hn::Mul(load(sums.yy), share);
    const Vector half = Constant(0.5);
    const Vector spread =
        hn::Add(hn::Mul(hn::Add(xx, yy), half), Length(hn::Mul(hn::Sub(xx, yy), half), xy));
    const Vector gap = hn::Mul(hn::Sub(spread, gap_spread_), gap_slope_);
    const DensityBranches branches = BranchesOf(value);
    const Vector f = hn::Min(hn::Max(hn::Max(phi, branches.guard), gap), branches.saturation);
    // No kernel reaches the node.
    return hn::IfThenElse(hn::Gt(k, hn::Zero(d_)), f, asked_.is_open ? void_value_ : value);
  }

 private:
  static HWY_INLINE Vector Constant(double value) {
    return hn::Set(Lanes(), static_cast<float>(value));
  }

  static HWY_INLINE Vector Length(Vector x, Vector y) {
    return hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y)));
  }

  HWY_INLINE DensityBranches BranchesOf(Vector value) const {
    if (asked_.is_open) {
      const Vector f = hn::Mul(weight_, value);
      return {hn::Mul(hn::Sub(guard_, f), slope_), hn::Mul(hn::Sub(saturation_, f), slope_)};
    }
    // The value is the one that has decided the side, which the other then cannot change.
    const Vector between = hn::Mul(hn::Sub(saturation_, guard_), slope_);
    const auto is_inside = hn::Lt(value, hn::Zero(d_));
    return {hn::IfThenElse(is_inside, hn::Sub(value, between), value),
            hn::IfThenElse(is_inside, value, hn::Add(value, between))};
  }

  const Lanes d_;
  const AskedNodes& asked_;
  const Vector weight_, guard_, saturation_, slope_, gap_spread_, gap_slope_, reference_radius_,
      void_value_, inverse_square_;
};

BitRows EvaluateNodes(const AskedNodes& asked, const MomentSums& sums, float weight,
                      const Scale& scale, float* values) {
  const Lanes d;
  const NodeFormula formula(asked, weight, scale);
  BitRows inside{};
  for (int j = 0; j < kTileSize; ++j) {
    for (int i = 0; i < kTileSize; i += kLanes) {
      const auto bits = static_cast<std::uint8_t>(asked.rows[j] >> i & ((1u << kLanes) - 1));
      if (bits == 0) continue;
      float* const at = values + j * kTileSize + i;
      const Vector before = hn::LoadU(d, at);
      const Vector value = formula(before, sums, SumIndex(i, j));
      const std::uint8_t bytes[8] = {bits};
      hn::StoreU(hn::IfThenElse(hn::LoadMaskBits(d, bytes), value, before), d, at);
      inside[j] |= (BitsOf(hn::Lt(value, hn::Zero(d))) & bits) << i;
    }
  }
  return inside;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ScatterNearKernels);
HWY_EXPORT(ClassifyNodes);
HWY_EXPORT(EvaluateNodes);

void ScatterNearKernels(const NearEntries& near, const float* weight, float radius,
                        NodeSums& sums) {
  HWY_DYNAMIC_DISPATCH(ScatterNearKernels)(near, weight, radius, sums);
}

void ClassifyNodes(float weight, const Scale& scale, NodeRange rows, float* values, BitRows& inside,
                   BitRows& open) {
  HWY_DYNAMIC_DISPATCH(ClassifyNodes)(weight, scale, rows, values, inside, open);
}

BitRows EvaluateNodes(const AskedNodes& asked, const MomentSums& sums, float weight,
                      const Scale& scale, float* values) {
  return HWY_DYNAMIC_DISPATCH(EvaluateNodes)(asked, sums, weight, scale, values);
}

}  // namespace partiemc
#endif  // HWY_ONCE
