// Sums over the particles near a point, in vectors of floats. Particles within reach are copied
// together first, so that the sums of all points of a cell run over one short array. Particle k of
// that array goes to partial sum k modulo sixteen, and the sixteen are added up in one tree,
// however wide the vectors of the processor are: the bits are the same everywhere. Compiled once
// for each target, hence the guard that each of them turns.
#if defined(PARTIEMC_NEIGHBOUR_SUMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_NEIGHBOUR_SUMS_INL_H
#undef PARTIEMC_NEIGHBOUR_SUMS_INL_H
#else
#define PARTIEMC_NEIGHBOUR_SUMS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "base/compressor-inl.h"
#include "sampler/neighbour_query.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kPartialSums = kRowPadding;

using Lanes = hn::CappedTag<float, kPartialSums>;
using Vector = hn::Vec<Lanes>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lanes()));
constexpr int kParts = kPartialSums / kLanes;

// Particles beside each other, in coordinates relative to NeighbourRows' origin, then at least
// kPartialSums that are far from everything.
struct NeighbourChunk {
  static constexpr int kCapacity = 128;
  static constexpr float kFar = 1e6f;
  static constexpr int kRoom = kCapacity + kPartialSums;

  HWY_ALIGN float x[kRoom];
  HWY_ALIGN float y[kRoom];
  HWY_ALIGN float weight[kRoom];
  int count;
};

// Where particles of a query lie, and which of them are within reach, in registers.
class NeighbourDisc {
 public:
  HWY_INLINE explicit NeighbourDisc(const NeighbourRows& near)
      : xs_(near.x),
        ys_(near.y),
        weights_(near.weight),
        column_(hn::Set(Lanes(), near.column)),
        centre_x_(hn::Set(Lanes(), near.centre_x)),
        centre_y_(hn::Set(Lanes(), near.centre_y)),
        reach_square_(hn::Set(Lanes(), near.reach_square)) {}

  // Writes those of the particles [first, last) of a band, at most kPartialSums, that are within
  // reach behind the first `to` particles of a chunk, which has room for them. Returns how many it
  // has then.
  template <bool kWeighted>
  HWY_INLINE int Append(Vector origin_y, std::uint32_t first, std::uint32_t last, int to,
                        NeighbourChunk& chunk) const {
    const Lanes d;
    const Compressor::Bits d_bits;
    const auto period = hn::Set(d, kColumnPeriod);
    const auto per_period = hn::Set(d, 1 / kColumnPeriod);
    for (int part = 0; part < kParts; ++part, first += kLanes) {
      const auto column = hn::Sub(hn::LoadU(d, xs_ + first), column_);
      const auto x = hn::Sub(column, hn::Mul(hn::Round(hn::Mul(column, per_period)), period));
      const auto y = hn::Sub(hn::LoadU(d, ys_ + first), origin_y);
      const auto dx = hn::Sub(x, centre_x_);
      const auto dy = hn::Sub(y, centre_y_);
      const auto square = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
      const auto is_near = hn::RebindMask(d_bits, hn::Lt(square, reach_square_));
      const auto place = hn::Add(hn::Iota(d_bits, 0), hn::Set(d_bits, static_cast<int>(first)));
      const auto is_particle = hn::Lt(place, hn::Set(d_bits, static_cast<int>(last)));
      const auto is_in = hn::And(is_near, is_particle);
      const Compressor compress(is_in);
      hn::StoreU(compress(d, x), d, chunk.x + to);
      hn::StoreU(compress(d, y), d, chunk.y + to);
      if constexpr (kWeighted) {
        hn::StoreU(compress(d, hn::LoadU(d, weights_ + first)), d, chunk.weight + to);
      }
      to += static_cast<int>(hn::CountTrue(d_bits, is_in));
    }
    return to;
  }

 private:
  const float *xs_, *ys_, *weights_;
  Vector column_, centre_x_, centre_y_, reach_square_;
};

// Ends a chunk with particles that are far from everything.
template <bool kWeighted>
HWY_INLINE void Close(NeighbourChunk& chunk) {
  const Lanes d;
  for (int part = 0; part < kParts; ++part) {
    const int to = chunk.count + part * kLanes;
    hn::StoreU(hn::Set(d, NeighbourChunk::kFar), d, chunk.x + to);
    hn::StoreU(hn::Set(d, NeighbourChunk::kFar), d, chunk.y + to);
    if constexpr (kWeighted) hn::StoreU(hn::Zero(d), d, chunk.weight + to);
  }
}

// Calls visit(chunk) for the particles of `near`, as many at a time as a chunk holds.
template <bool kWeighted, typename Visit>
HWY_INLINE void ForEachChunk(const NeighbourRows& near, Visit visit) {
  const NeighbourDisc disc(near);
  NeighbourChunk chunk;
  chunk.count = 0;
  const auto use_up = [&]() HWY_ATTR {
    Close<kWeighted>(chunk);
    visit(std::as_const(chunk));
    chunk.count = 0;
  };
  for (int b = 0; b < near.band_count; ++b) {
    const NeighbourBand& band = near.bands[b];
    const Vector origin_y = hn::Set(Lanes(), band.origin_y);
    const std::uint32_t* offsets = band.offsets;
    const std::uint32_t* const end = offsets + band.rows * band.row_stride;
    for (; offsets != end; offsets += band.row_stride) {
      std::uint32_t first = offsets[0];
      const std::uint32_t last = offsets[band.columns];
      do {
        if (HWY_UNLIKELY(chunk.count + kPartialSums > NeighbourChunk::kCapacity)) use_up();
        chunk.count = disc.Append<kWeighted>(origin_y, first, last, chunk.count, chunk);
        first += kPartialSums;
      } while (HWY_UNLIKELY(first < last));
    }
  }
  if (chunk.count > 0) use_up();
}

// Lane k is the sum over all lanes of sums[k]: of lanes i and i + 8, of these i and i + 4 and so
// on. Those from `count` on are 0.
HWY_INLINE Vector SumsOfLanes(int count, Vector (&sums)[kLanes]) {
#if HWY_TARGET == HWY_SCALAR
  return sums[0];
#else
  const Lanes d;
  if constexpr (kLanes == 16) {
    for (int k = 0; k < std::min(count, 8); ++k) {
      sums[k] = hn::Add(hn::ConcatLowerLower(d, sums[k + 8], sums[k]),
                        hn::ConcatUpperUpper(d, sums[k + 8], sums[k]));
    }
    // In blocks of four lanes: those of k, k + 4, k + 8, k + 12.
    for (int k = 0; k < std::min(count, 4); ++k) {
      sums[k] = hn::Add(hn::OddEvenBlocks(hn::SwapAdjacentBlocks(sums[k + 4]), sums[k]),
                        hn::OddEvenBlocks(sums[k + 4], hn::SwapAdjacentBlocks(sums[k])));
    }
  } else if constexpr (kLanes == 8) {
    for (int k = 0; k < std::min(count, 4); ++k) {
      sums[k] = hn::Add(hn::ConcatLowerLower(d, sums[k + 4], sums[k]),
                        hn::ConcatUpperUpper(d, sums[k + 4], sums[k]));
    }
  }
  const hn::Repartition<double, Lanes> d_pair;
  const auto pairs = [&](int k) HWY_ATTR {
    return hn::BitCast(d_pair, hn::Add(hn::InterleaveLower(d, sums[k], sums[k + 1]),
                                       hn::InterleaveUpper(d, sums[k], sums[k + 1])));
  };
  const auto lower = pairs(0);
  const auto upper = pairs(2);
  return hn::Add(hn::BitCast(d, hn::InterleaveLower(d_pair, lower, upper)),
                 hn::BitCast(d, hn::InterleaveUpper(d_pair, lower, upper)));
#endif
}

// Sixteen partial sums of each of several channels.
template <int kChannels>
class PartialSums {
 public:
  // Calls add(k, sums) for each vector of a chunk, k its first particle and sums its channels.
  template <typename Add>
  HWY_INLINE PartialSums(const NeighbourChunk& chunk, Add add) {
    for (int part = 0; part < kParts; ++part) {
      Vector sums[kChannels];
      for (Vector& sum : sums) sum = hn::Zero(Lanes());
      for (int k = part * kLanes; k < chunk.count; k += kPartialSums) add(k, sums);
      for (int channel = 0; channel < kChannels; ++channel) parts_[channel][part] = sums[channel];
    }
  }

  // Adds the channels' totals: total_of(channel) is a double&.
  template <typename TotalOf>
  HWY_INLINE void AddTo(TotalOf total_of) {
    HWY_ALIGN float totals[kLanes];
    for (int first = 0; first < kChannels; first += kLanes) {
      const int count = std::min(kLanes, kChannels - first);
      Vector sums[kLanes];
      for (int k = 0; k < kLanes; ++k) sums[k] = k < count ? Fold(first + k) : hn::Zero(Lanes());
      hn::Store(SumsOfLanes(count, sums), Lanes(), totals);
      for (int k = 0; k < count; ++k) total_of(first + k) += totals[k];
    }
  }

 private:
  // Partial sums i and i + 8, then i and i + 4, as far as they are in different vectors.
  HWY_INLINE Vector Fold(int channel) {
    for (int count = kParts / 2; count > 0; count /= 2) {
      for (int part = 0; part < count; ++part) {
        parts_[channel][part] = hn::Add(parts_[channel][part], parts_[channel][part + count]);
      }
    }
    return parts_[channel][0];
  }

  Vector parts_[kChannels][kParts];
};

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
