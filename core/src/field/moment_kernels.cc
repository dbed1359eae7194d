#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "field/tile_kernels.h"

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "field/moment_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "base/compressor-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, NodeBlock::kNodes>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));

// Selected particles: coordinates along the axis of selection and along the other axis; sizes if
// sizes differ.
struct Chosen {
  alignas(64) ParticleBlock::PerParticle<float> along, across, size;
  int count;
};

// Selects the particles whose kernels may reach nodes `first` to `first` + kSide - 1 along an axis.
// Their coordinates along this axis become relative to node `first`.
template <bool kSized>
HWY_INLINE void Choose(const float* along, const float* across, [[maybe_unused]] const float* size,
                       int count, int first, float radius, Chosen& chosen) {
  const Lanes d;
  constexpr float kMiddle = (NodeBlock::kSide - 1) / 2.0f;
  const auto origin = hn::Set(d, static_cast<float>(first));
  const auto middle = hn::Set(d, kMiddle);
  const auto reach = hn::Set(d, radius + kMiddle);
  int chosen_count = 0;
  for (int k = 0; k < count; k += kLanes) {
    const Vector at = hn::Sub(hn::LoadU(d, along + k), origin);
    Vector own = reach;
    if constexpr (kSized) {
      own = hn::Add(hn::Mul(hn::LoadU(d, size + k), hn::Set(d, radius)), middle);
    }
    const auto reaches = hn::Lt(hn::Abs(hn::Sub(at, middle)), own);
    const auto is_in = hn::And(reaches, hn::FirstN(d, static_cast<std::size_t>(count - k)));
    const Compressor compress(hn::RebindMask(hn::RebindToSigned<Lanes>(), is_in));
    hn::StoreU(compress(d, at), d, chosen.along.data() + chosen_count);
    hn::StoreU(compress(d, hn::LoadU(d, across + k)), d, chosen.across.data() + chosen_count);
    if constexpr (kSized) {
      hn::StoreU(compress(d, hn::LoadU(d, size + k)), d, chosen.size.data() + chosen_count);
    }
    chosen_count += static_cast<int>(hn::CountTrue(d, is_in));
  }
  chosen.count = chosen_count;
}

// Columns and rows of the nodes of a block.
alignas(64) constexpr float kColumns[] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) constexpr float kRows[] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

// Adds the moments of particles; x and y are relative to the first node of the block. The sums stay
// in registers.
template <bool kKernel, bool kSized>
HWY_INLINE void AddMoments(const float* x, const float* y, [[maybe_unused]] const float* size,
                           int count, float inverse_square, BlockSums& sums) {
  const Lanes d;
  const Vector scale = hn::Set(d, inverse_square);
  const Vector one = hn::Set(d, 1.0f);
  for (int part = 0; part < NodeBlock::kNodes; part += kLanes) {
    const Vector column = hn::Load(d, kColumns + part), row = hn::Load(d, kRows + part);
    const auto sum = [&](BlockSums::Channel& of) HWY_ATTR { return hn::Load(d, of.data() + part); };
    Vector kernel = sum(sums.kernel), moment_x = sum(sums.moment_x), moment_y = sum(sums.moment_y);
    Vector xx = sum(sums.xx), xy = sum(sums.xy), yy = sum(sums.yy), sizes = sum(sums.size);
    for (int e = 0; e < count; ++e) {
      Vector dx = hn::Sub(hn::Set(d, x[e]), column);
      Vector dy = hn::Sub(hn::Set(d, y[e]), row);
      if constexpr (kSized) {
        const Vector per_size = hn::Set(d, 1 / size[e]);
        dx = hn::Mul(dx, per_size);
        dy = hn::Mul(dy, per_size);
      }
      const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
      const Vector t = hn::Max(hn::Zero(d), hn::Sub(one, hn::Mul(square, scale)));
      const Vector k = hn::Mul(hn::Mul(t, t), t);
      if constexpr (kKernel) kernel = hn::Add(kernel, k);
      if constexpr (kSized) sizes = hn::Add(sizes, hn::Mul(k, hn::Set(d, size[e])));
      const Vector kx = hn::Mul(k, dx);
      const Vector ky = hn::Mul(k, dy);
      moment_x = hn::Add(moment_x, kx);
      moment_y = hn::Add(moment_y, ky);
      xx = hn::Add(xx, hn::Mul(kx, dx));
      xy = hn::Add(xy, hn::Mul(kx, dy));
      yy = hn::Add(yy, hn::Mul(ky, dy));
    }
    const auto set = [&](Vector value, BlockSums::Channel& of)
                         HWY_ATTR { hn::Store(value, d, of.data() + part); };
    if constexpr (kKernel) set(kernel, sums.kernel);
    if constexpr (kSized) set(sizes, sums.size);
    set(moment_x, sums.moment_x);
    set(moment_y, sums.moment_y);
    set(xx, sums.xx);
    set(xy, sums.xy);
    set(yy, sums.yy);
  }
}

// Lowers the distances of a block; x and y are relative to its first node.
HWY_INLINE void AddGrains(const float* x, const float* y, const float* size, int count,
                          float spacing, BlockSums::Channel& distances) {
  const Lanes d;
  for (int part = 0; part < NodeBlock::kNodes; part += kLanes) {
    const Vector column = hn::Load(d, kColumns + part), row = hn::Load(d, kRows + part);
    Vector least = hn::Load(d, distances.data() + part);
    for (int e = 0; e < count; ++e) {
      const Vector dx = hn::Sub(hn::Set(d, x[e]), column);
      const Vector dy = hn::Sub(hn::Set(d, y[e]), row);
      const Vector square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
      const Vector radius = hn::Set(d, size[e] * spacing * 0.5f);
      least = hn::Min(least, hn::Sub(hn::Sqrt(square), radius));
    }
    hn::Store(least, d, distances.data() + part);
  }
}

// Calls add(b, chosen) for each block with the particles whose kernels may reach it.
template <bool kSized, typename Add>
HWY_INLINE void ForEachReached(const ParticleBlock& near, float radius, const NodeBlocks& blocks,
                               Add add) {
  Chosen of_rows, of_block;
  int row = -1;
  for (int b = 0; b < blocks.count; ++b) {
    const NodeBlock& block = blocks[b];
    if (block.row != row) {
      row = block.row;
      Choose<kSized>(near.y.data(), near.x.data(), near.size.data(), near.count, row, radius,
                     of_rows);
    }
    Choose<kSized>(of_rows.across.data(), of_rows.along.data(), of_rows.size.data(), of_rows.count,
                   block.column, radius, of_block);
    add(b, std::as_const(of_block));
  }
}

template <bool kSized>
void AddNearMomentsOf(const ParticleBlock& near, float radius, const NodeBlocks& blocks,
                      bool has_kernel_sums, MomentSums& sums) {
  const float inverse_square = 1 / (radius * radius);
  const auto add = has_kernel_sums ? AddMoments<false, kSized> : AddMoments<true, kSized>;
  ForEachReached<kSized>(near, radius, blocks, [&](int b, const Chosen& chosen) HWY_ATTR {
    add(chosen.along.data(), chosen.across.data(), chosen.size.data(), chosen.count, inverse_square,
        sums[b]);
  });
}

void AddNearGrains(const ParticleBlock& near, const Scale& scale, const NodeBlocks& blocks,
                   GrainDistances& distances) {
  const auto spacing = static_cast<float>(scale.spacing);
  const auto radius = static_cast<float>(scale.kernel_radius);
  ForEachReached<true>(near, radius, blocks, [&](int b, const Chosen& chosen) HWY_ATTR {
    AddGrains(chosen.along.data(), chosen.across.data(), chosen.size.data(), chosen.count, spacing,
              distances.blocks[b]);
  });
}

void AddNearMoments(const ParticleBlock& near, bool has_sizes, float radius,
                    const NodeBlocks& blocks, bool has_kernel_sums, MomentSums& sums) {
  const auto add = has_sizes ? AddNearMomentsOf<true> : AddNearMomentsOf<false>;
  add(near, radius, blocks, has_kernel_sums, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(AddNearGrains);
HWY_EXPORT(AddNearMoments);

void AddNearGrains(const ParticleBlock& near, const Scale& scale, const NodeBlocks& blocks,
                   GrainDistances& distances) {
  HWY_DYNAMIC_DISPATCH(AddNearGrains)(near, scale, blocks, distances);
}

void AddNearMoments(const ParticleBlock& near, bool has_sizes, float radius,
                    const NodeBlocks& blocks, bool has_kernel_sums, MomentSums& sums) {
  HWY_DYNAMIC_DISPATCH(AddNearMoments)(near, has_sizes, radius, blocks, has_kernel_sums, sums);
}

NodeBlocks BlocksOf(const BitRows& asked) {
  constexpr int kSide = NodeBlock::kSide, kLast = kTileSize - kSide;
  constexpr std::uint32_t kColumns = (1u << kSide) - 1;
  NodeBlocks blocks;
  BitRows left = asked;
  for (int j = 0; j < kTileSize; ++j) {
    if (left[j] == 0) continue;
    const int row = std::min(j, kLast);
    std::uint32_t any = left[row] | left[row + 1] | left[row + 2] | left[row + 3];
    while (any != 0) {
      const int column = std::min(std::countr_zero(any), kLast);
      any &= ~(kColumns << column);
      NodeBlock& block = blocks.blocks[blocks.count++];
      block = {.column = static_cast<std::uint8_t>(column), .row = static_cast<std::uint8_t>(row)};
      for (int k = 0; k < kSide; ++k) {
        const std::uint32_t bits = left[row + k] >> column & kColumns;
        block.asked = static_cast<std::uint16_t>(block.asked | bits << k * kSide);
        left[row + k] &= ~(kColumns << column);
      }
    }
  }
  return blocks;
}

}  // namespace partiemc
#endif  // HWY_ONCE
