#include "field/tile_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/tile_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "field/level_set_formula.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, NodeBlock::kNodes>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

template <class D>
HWY_INLINE std::uint32_t BitsOf(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] | std::uint32_t{bytes[1]} << 8;
}

void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& inside,
                   BitRows& open) {
  const Lanes d;
  const Vector guard = hn::Set(d, static_cast<float>(scale.guard));
  const Vector saturation = hn::Set(d, static_cast<float>(scale.saturation));
  const Vector slope = hn::Set(d, static_cast<float>(scale.guard_slope));
  const Vector void_value = hn::Set(d, static_cast<float>(VoidValue(scale)));
  for (int j = 0; j < kTileSize; ++j) {
    std::uint32_t inside_row = 0, open_row = 0;
    for (int i = 0; i < kTileSize; i += kLanes) {
      const Vector sum = hn::LoadU(d, values + j * kTileSize + i);
      const Vector f = hn::Mul(hn::Set(d, weight), sum);
      const auto is_inside = hn::Gt(f, saturation);
      const auto is_open = hn::AndNot(is_inside, hn::Gt(f, guard));
      inside_row |= BitsOf(d, is_inside) << i;
      open_row |= BitsOf(d, is_open) << i;
      const Vector branch = hn::IfThenElse(is_inside, saturation, guard);
      const Vector value = hn::Mul(hn::Sub(branch, f), slope);
      const Vector decided = hn::IfThenElse(hn::Eq(f, hn::Zero(d)), void_value, value);
      hn::StoreU(hn::IfThenElse(is_open, sum, decided), d, values + j * kTileSize + i);
    }
    inside[j] = inside_row;
    open[j] = open_row;
  }
}

// The terms of F that depend on the density alone.
struct DensityBranches {
  Vector guard, saturation;
};

// LevelSetValue in vectors.
class NodeFormula {
 public:
  HWY_INLINE NodeFormula(const AskedNodes& asked, float weight, const Scale& scale)
      : asked_(asked),
        has_own_sizes_(scale.has_own_sizes),
        weight_(hn::Set(d_, weight)),
        guard_(Constant(scale.guard)),
        saturation_(Constant(scale.saturation)),
        slope_(Constant(scale.guard_slope)),
        gap_spread_(Constant(scale.gap_spread)),
        gap_slope_(Constant(scale.gap_slope)),
        reference_radius_(Constant(scale.reference_radius)),
        void_value_(Constant(VoidValue(scale))),
        inverse_square_(Constant(1 / (scale.kernel_radius * scale.kernel_radius))) {}

  // F at the nodes of a block from `first` on. `value`: the results of ClassifyNodes at these
  // nodes.
  HWY_INLINE Vector operator()(Vector value, const BlockSums& sums, int first) const {
    const auto load = [&](const BlockSums::Channel& of)
                          HWY_ATTR { return hn::Load(d_, of.data() + first); };
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
    Vector f = hn::Min(hn::Max(hn::Max(phi, branches.guard), gap), branches.saturation);
    if (has_own_sizes_) f = hn::Mul(f, hn::Mul(load(sums.size), inverse));
    // If k is 0, no kernel reaches the node.
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
    // `value` is the density term that decided the side. The other density term is `between` away.
    const Vector between = hn::Mul(hn::Sub(saturation_, guard_), slope_);
    const auto is_inside = hn::Lt(value, hn::Zero(d_));
    return {hn::IfThenElse(is_inside, hn::Sub(value, between), value),
            hn::IfThenElse(is_inside, value, hn::Add(value, between))};
  }

  const Lanes d_;
  const AskedNodes& asked_;
  const bool has_own_sizes_;
  const Vector weight_, guard_, saturation_, slope_, gap_spread_, gap_slope_, reference_radius_,
      void_value_, inverse_square_;
};

// Sets the requested values of a block to F. Returns the bits of the nodes that are inside.
HWY_INLINE unsigned EvaluateBlock(const NodeFormula& formula, const BlockSums& sums, unsigned asked,
                                  BlockSums::Channel& values) {
  const Lanes d;
  unsigned inside = 0;
  for (int node = 0; node < NodeBlock::kNodes; node += kLanes) {
    const unsigned bits = asked >> node;
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits),
                                   static_cast<std::uint8_t>(bits >> 8)};
    float* const at = values.data() + node;
    const Vector before = hn::Load(d, at);
    const Vector value = formula(before, sums, node);
    hn::Store(hn::IfThenElse(hn::LoadMaskBits(d, bytes), value, before), d, at);
    inside |= BitsOf(d, hn::Lt(value, hn::Zero(d))) << node;
  }
  return inside & asked;
}

BitRows EvaluateNodes(const AskedNodes& asked, const NodeBlocks& blocks, const MomentSums& sums,
                      float weight, const Scale& scale, float* values) {
  constexpr int kSide = NodeBlock::kSide;
  const NodeFormula formula(asked, weight, scale);
  BitRows inside{};
  for (int b = 0; b < blocks.count; ++b) {
    const NodeBlock& block = blocks[b];
    float* const first = values + block.row * kTileSize + block.column;
    alignas(64) BlockSums::Channel of_block;
    for (int k = 0; k < kSide; ++k) {
      std::memcpy(of_block.data() + k * kSide, first + k * kTileSize, kSide * sizeof(float));
    }
    const unsigned bits = EvaluateBlock(formula, sums[b], block.asked, of_block);
    for (int k = 0; k < kSide; ++k) {
      std::memcpy(first + k * kTileSize, of_block.data() + k * kSide, kSide * sizeof(float));
      inside[block.row + k] |= (bits >> k * kSide & ((1u << kSide) - 1)) << block.column;
    }
  }
  return inside;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ClassifyNodes);
HWY_EXPORT(EvaluateNodes);

void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& inside,
                   BitRows& open) {
  HWY_DYNAMIC_DISPATCH(ClassifyNodes)(weight, scale, values, inside, open);
}

BitRows EvaluateNodes(const AskedNodes& asked, const NodeBlocks& blocks, const MomentSums& sums,
                      float weight, const Scale& scale, float* values) {
  return HWY_DYNAMIC_DISPATCH(EvaluateNodes)(asked, blocks, sums, weight, scale, values);
}

}  // namespace partiemc
#endif  // HWY_ONCE
