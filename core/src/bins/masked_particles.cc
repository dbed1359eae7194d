#include "bins/masked_particles.h"

#include <algorithm>
#include <cmath>

#include "base/prefetch.h"

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bins/masked_particles.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "base/compressor-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, ParticleBlock::kPadding>;
using Indices = hn::RebindToUnsigned<Lanes>;
using Bits = hn::RebindToSigned<Lanes>;

// The middle of the nodes of a tile, along an axis.
constexpr float kMiddle = (kTileSize - 1) / 2.0f;
// Prefetch distance in particles.
constexpr std::uint32_t kAskedAhead = 128;

// Adds the particles of `list` before the index `last` to `near` if they lie in the cells of the
// list and, if there are sizes, reach a node of the tile. Reads whole vectors, also beyond `last`.
template <bool kSized>
void ChooseParticlesOf(std::span<const BinnedParticle> particles,
                       [[maybe_unused]] std::span<const float> sizes, [[maybe_unused]] float radius,
                       const MaskedParticles::List& list, std::uint32_t last, ParticleBlock& near) {
  const Lanes d;
  const Bits d_bits;
  const Indices d_index;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const auto* const rows = reinterpret_cast<const std::int32_t*>(list.cells.data());
  std::uint32_t first = list.next;
  int chosen = near.count;
  for (; first < last && first + lanes <= particles.size(); first += lanes) {
    const std::size_t later = std::min<std::size_t>(first + kAskedAhead, particles.size() - lanes);
    PrefetchLines(particles.subspan(later, lanes));
    hn::Vec<Lanes> x, y, source;
    hn::LoadInterleaved3(d, &particles[first].x, x, y, source);
    // Truncation rounds down: coordinates in a tile are not negative.
    const auto row = hn::GatherIndex(d_bits, rows, hn::ConvertTo(d_bits, y));
    const auto bit = hn::Shl(hn::Set(d_bits, 1), hn::ConvertTo(d_bits, x));
    x = hn::Add(x, hn::Set(d, list.shift_x));
    y = hn::Add(y, hn::Set(d, list.shift_y));
    auto is_in = hn::And(hn::TestBit(row, bit), hn::FirstN(d_bits, last - first));
    hn::Vec<Lanes> size = hn::Zero(d);
    if constexpr (kSized) {
      size = hn::LoadU(d, sizes.data() + first);
      const auto middle = hn::Set(d, kMiddle);
      const auto reach = hn::Add(hn::Mul(hn::Set(d, radius), size), middle);
      const auto far = hn::Max(hn::Abs(hn::Sub(x, middle)), hn::Abs(hn::Sub(y, middle)));
      is_in = hn::And(is_in, hn::RebindMask(d_bits, hn::Lt(far, reach)));
    }
    const Compressor compress(is_in);
    hn::StoreU(compress(d, x), d, near.x.data() + chosen);
    hn::StoreU(compress(d, y), d, near.y.data() + chosen);
    if constexpr (kSized) hn::StoreU(compress(d, size), d, near.size.data() + chosen);
    const auto index = hn::Add(hn::Set(d_index, first), hn::Iota(d_index, 0));
    hn::StoreU(compress(d_index, index), d_index, near.particle.data() + chosen);
    chosen += static_cast<int>(hn::CountTrue(d_bits, is_in));
  }
  for (; first < last; ++first) {
    const BinnedParticle& particle = particles[first];
    near.x[chosen] = particle.x + list.shift_x;
    near.y[chosen] = particle.y + list.shift_y;
    near.particle[chosen] = first;
    bool is_in = LiesIn(particle, list.cells);
    if constexpr (kSized) {
      const float far =
          std::max(std::abs(near.x[chosen] - kMiddle), std::abs(near.y[chosen] - kMiddle));
      near.size[chosen] = sizes[first];
      is_in &= far < radius * sizes[first] + kMiddle;
    }
    chosen += is_in;
  }
  near.count = chosen;
}

void ChooseParticles(std::span<const BinnedParticle> particles, std::span<const float> sizes,
                     float radius, const MaskedParticles::List& list, std::uint32_t last,
                     ParticleBlock& near) {
  const auto choose = sizes.empty() ? ChooseParticlesOf<false> : ChooseParticlesOf<true>;
  choose(particles, sizes, radius, list, last, near);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ChooseParticles);

MaskedParticles::MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask,
                                 float radius)
    : MaskedParticles(bins, tile, mask) {
  sizes_ = bins.size;
  radius_ = radius;
}

MaskedParticles::MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask)
    : particles_(bins.particles) {
  const Neighbourhood& neighbours = bins.tiles.neighbours(tile);
  for (int place = 0; place < kMaxLists; ++place) {
    const std::uint32_t from = neighbours[place];
    if (from == kNoTile || bins.CountOf(from) == 0) continue;
    List& list = lists_[list_count_];
    if (mask != nullptr) {
      list.cells = CellsOfNeighbour(*mask, place);
      if (IsEmpty(list.cells)) continue;
    } else {
      list.cells.fill(~std::uint32_t{0});
    }
    list.next = bins.offsets[from];
    list.end = bins.offsets[from + 1];
    list.shift_x = static_cast<float>((place % 3 - 1) * kTileSize);
    list.shift_y = static_cast<float>((place / 3 - 1) * kTileSize);
    ++list_count_;
  }
}

// Selects particles until the block is full. Returns false if none are left.
bool MaskedParticles::ChooseMore() {
  chosen_.count = 0;
  for (; list_ < list_count_; ++list_) {
    List& list = lists_[list_];
    while (list.next < list.end) {
      const int room = ParticleBlock::kCapacity - chosen_.count;
      if (room < kLeastRoom) return true;
      const std::uint32_t last =
          list.next + std::min(static_cast<std::uint32_t>(room), list.end - list.next);
      HWY_DYNAMIC_DISPATCH(ChooseParticles)(particles_, sizes_, radius_, list, last, chosen_);
      list.next = last;
    }
  }
  return chosen_.count > 0;
}

}  // namespace partiemc
#endif  // HWY_ONCE
