// Sums over the particles near a point, in SIMD vectors of floats. The particles within reach are
// first copied to a short array, which serves all points of a query. Particle k of the array goes
// to partial sum k modulo sixteen. The sixteen sums are added in one fixed tree, so the bits do not
// depend on the width of vectors. Compiled once for each instruction set, so the include guard
// toggles.
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

// The factor of each particle that some sums need.
enum class Factor { kNone, kWeight, kSize };

// Packed particles in coordinates relative to the origin of NeighbourRows. After Close,
// kPartialSums distant dummies with kernels of 0 follow.
struct NeighbourChunk {
  static constexpr int kCapacity = 128;
  static constexpr float kFar = 1e6f;
  static constexpr int kRoom = kCapacity + kPartialSums;

  HWY_ALIGN float x[kRoom];
  HWY_ALIGN float y[kRoom];
  HWY_ALIGN float factor[kRoom];
  int count;
};

// The disc that selects the particles of a query, in registers.
class NeighbourDisc {
 public:
  HWY_INLINE explicit NeighbourDisc(const NeighbourRows& near)
      : xs_(near.x),
        ys_(near.y),
        factors_(near.size != nullptr ? near.size : near.weight),
        column_(hn::Set(Lanes(), near.column)),
        centre_x_(hn::Set(Lanes(), near.centre_x)),
        centre_y_(hn::Set(Lanes(), near.centre_y)),
        reach_square_(hn::Set(Lanes(), near.reach_square)),
        reach_(hn::Set(Lanes(), near.reach)),
        reach_per_size_(hn::Set(Lanes(), near.reach_per_size)) {}

  // Reads the first kPartialSums particles of [first, last). Appends those in the disc to a chunk
  // of `to` particles, with space for kPartialSums more. Returns the new number of particles.
  template <Factor kFactor>
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
      Vector reach_square = reach_square_;
      if constexpr (kFactor == Factor::kSize) {
        const auto size = hn::LoadU(d, factors_ + first);
        const Vector reach = hn::Add(reach_, hn::Mul(reach_per_size_, size));
        reach_square = hn::Mul(reach, reach);
      }
      const auto is_near = hn::RebindMask(d_bits, hn::Lt(square, reach_square));
      const auto place = hn::Add(hn::Iota(d_bits, 0), hn::Set(d_bits, static_cast<int>(first)));
      const auto is_particle = hn::Lt(place, hn::Set(d_bits, static_cast<int>(last)));
      const auto is_in = hn::And(is_near, is_particle);
      const Compressor compress(is_in);
      hn::StoreU(compress(d, x), d, chunk.x + to);
      hn::StoreU(compress(d, y), d, chunk.y + to);
      if constexpr (kFactor != Factor::kNone) {
        hn::StoreU(compress(d, hn::LoadU(d, factors_ + first)), d, chunk.factor + to);
      }
      to += static_cast<int>(hn::CountTrue(d_bits, is_in));
    }
    return to;
  }

 private:
  const float *xs_, *ys_, *factors_;
  Vector column_, centre_x_, centre_y_, reach_square_, reach_, reach_per_size_;
};

// Appends distant dummies with kernels of 0, which fill the last vector.
template <Factor kFactor>
HWY_INLINE void Close(NeighbourChunk& chunk) {
  const Lanes d;
  for (int part = 0; part < kParts; ++part) {
    const int to = chunk.count + part * kLanes;
    hn::StoreU(hn::Set(d, NeighbourChunk::kFar), d, chunk.x + to);
    hn::StoreU(hn::Set(d, NeighbourChunk::kFar), d, chunk.y + to);
    if constexpr (kFactor != Factor::kNone) hn::StoreU(hn::Set(d, 1.0f), d, chunk.factor + to);
  }
}

// Collects the particles of `near` in a chunk. When the chunk may be full, calls make_room(). If
// that returns true, make_room has used the particles, and Collect begins the chunk anew. If that
// returns false, Collect stops and returns false.
template <Factor kFactor, typename MakeRoom>
HWY_INLINE bool Collect(const NeighbourRows& near, NeighbourChunk& chunk, MakeRoom make_room) {
  const NeighbourDisc disc(near);
  int count = 0;
  for (int b = 0; b < near.band_count; ++b) {
    const NeighbourBand& band = near.bands[b];
    const Vector origin_y = hn::Set(Lanes(), band.origin_y);
    const std::uint32_t* offsets = band.offsets;
    const std::uint32_t* const end = offsets + band.rows * band.row_stride;
    for (; offsets != end; offsets += band.row_stride) {
      std::uint32_t first = offsets[0];
      const std::uint32_t last = offsets[band.columns];
      do {
        if (HWY_UNLIKELY(count + kPartialSums > NeighbourChunk::kCapacity)) {
          chunk.count = std::exchange(count, 0);
          if (!make_room()) return false;
        }
        count = disc.Append<kFactor>(origin_y, first, last, count, chunk);
        first += kPartialSums;
      } while (HWY_UNLIKELY(first < last));
    }
  }
  chunk.count = count;
  return true;
}

// Calls visit(chunk) for the particles of `near`, one chunk after another.
template <Factor kFactor, typename Visit>
HWY_INLINE void ForEachChunk(const NeighbourRows& near, NeighbourChunk& chunk, Visit visit) {
  const auto empty = [&]() HWY_ATTR {
    Close<kFactor>(chunk);
    visit(std::as_const(chunk));
    return true;
  };
  Collect<kFactor>(near, chunk, empty);
  if (chunk.count > 0) empty();
}

// Collects the particles of `near` in one chunk. Returns false if they may not fit.
template <Factor kFactor>
HWY_INLINE bool Gather(const NeighbourRows& near, NeighbourChunk& chunk) {
  const bool fits = Collect<kFactor>(near, chunk, [] { return false; });
  if (fits) Close<kFactor>(chunk);
  return fits;
}

// Calls visit(query, chunk, is_all) for the particles of each query, one chunk after another.
// `query` is an index. `is_all`: the chunk has all particles of the query. The particles of all
// queries are copied first, so that the sums of a query do not wait for memory.
template <Factor kFactor, typename Query, typename Visit>
HWY_INLINE void ForEachQuery(std::span<const Query> queries, Visit visit) {
  NeighbourChunk chunks[kQueriesAtOnce];
  bool fits[kQueriesAtOnce];
  for (std::size_t k = 0; k < queries.size(); ++k) {
    fits[k] = Gather<kFactor>(queries[k].near, chunks[k]);
  }
  for (std::size_t k = 0; k < queries.size(); ++k) {
    if (HWY_LIKELY(fits[k])) {
      visit(k, chunks[k], true);
    } else {
      ForEachChunk<kFactor>(queries[k].near, chunks[k],
                            [&](const NeighbourChunk& chunk) HWY_ATTR { visit(k, chunk, false); });
    }
  }
}

// Sixteen partial sums for each of several channels.
template <int kChannels>
class PartialSums {
 public:
  // Calls add(k, sums) for each vector of a chunk, to add its terms. k is its first particle;
  // `sums` has one vector for each channel.
  template <typename Add>
  HWY_INLINE PartialSums(const NeighbourChunk& chunk, Add add) {
    for (int part = 0; part < kParts; ++part) {
      Vector sums[kChannels];
      for (Vector& sum : sums) sum = hn::Zero(Lanes());
      for (int k = part * kLanes; k < chunk.count; k += kPartialSums) add(k, sums);
      for (int channel = 0; channel < kChannels; ++channel) parts_[channel][part] = sums[channel];
    }
  }

  // Stores the partial sums for TotalsAtPoints.
  template <typename Parts>
  HWY_INLINE void Store(Parts& parts, std::size_t point) const {
    for (int channel = 0; channel < kChannels; ++channel) {
      for (int part = 0; part < kParts; ++part) {
        hn::Store(parts_[channel][part], Lanes(), parts[channel][point] + part * kLanes);
      }
    }
  }

  // Adds the totals of the channels to `totals`.
  HWY_INLINE void AddTo(double (&totals)[kChannels]) {
    HWY_ALIGN float sums[kGroups * kGroup];
    for (int group = 0; group < kGroups; ++group) Total(group * kGroup, sums + group * kGroup);
    for (int channel = 0; channel < kChannels; ++channel) totals[channel] += sums[channel];
  }

 private:
  static constexpr int kGroup = 4;  // Channels that are totalled at once.
  static constexpr int kGroups = (kChannels + kGroup - 1) / kGroup;
  using Group = hn::CappedTag<float, kGroup>;

  // Adds partial sums i and i + 8, then i and i + 4; four remain.
  HWY_INLINE hn::Vec<Group> Fold(int channel) {
    if (channel >= kChannels) return hn::Zero(Group());
    for (int count = kParts / 2; count > 0; count /= 2) {
      for (int part = 0; part < count; ++part) {
        parts_[channel][part] = hn::Add(parts_[channel][part], parts_[channel][part + count]);
      }
    }
    return FoldLanes(Lanes(), parts_[channel][0]);
  }
  template <class D>
  static HWY_INLINE hn::Vec<Group> FoldLanes([[maybe_unused]] D d, hn::Vec<D> sums) {
#if HWY_TARGET != HWY_SCALAR
    if constexpr (hn::MaxLanes(D()) > kGroup) {
      const hn::Half<D> half;
      return FoldLanes(half, hn::Add(hn::LowerHalf(half, sums), hn::UpperHalf(half, sums)));
    } else
#endif
      return sums;
  }

  // The totals of the four channels from `channel` on: adds partial sums i and i + 2, then the
  // rest.
  HWY_INLINE void Total(int channel, float* totals) {
    const Group d;
    hn::Vec<Group> sums[kGroup];
    for (int k = 0; k < kGroup; ++k) sums[k] = Fold(channel + k);
#if HWY_TARGET == HWY_SCALAR
    for (int k = 0; k < kGroup; ++k) hn::Store(sums[k], d, totals + k);
#else
    const auto pair = [&](int k) HWY_ATTR {
      return hn::Add(hn::InterleaveLower(d, sums[k], sums[k + 1]),
                     hn::InterleaveUpper(d, sums[k], sums[k + 1]));
    };
    const auto first = pair(0);
    const auto second = pair(2);
    hn::Store(
        hn::Add(hn::ConcatLowerLower(d, second, first), hn::ConcatUpperUpper(d, second, first)), d,
        totals);
#endif
  }

  Vector parts_[kChannels][kParts];
};

// The totals of one channel at kLanes points, added in the order of PartialSums. Lane k is the
// total of parts[min(first + k, last)].
HWY_INLINE Vector TotalsAtPoints(const float (*parts)[kPartialSums], std::size_t first,
                                 std::size_t last) {
  const Lanes d;
  Vector sums[kLanes];
  for (std::size_t point = 0; point < kLanes; ++point) {
    const float* const from = parts[std::min(first + point, last)];
    Vector folded[kParts];
    for (int part = 0; part < kParts; ++part) folded[part] = hn::Load(d, from + part * kLanes);
    for (int count = kParts / 2; count > 0; count /= 2) {
      for (int part = 0; part < count; ++part) {
        folded[part] = hn::Add(folded[part], folded[part + count]);
      }
    }
    sums[point] = folded[0];
  }
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kLanes == 16) {
    for (int k = 0; k < 8; ++k) {
      sums[k] = hn::Add(hn::ConcatLowerLower(d, sums[k + 8], sums[k]),
                        hn::ConcatUpperUpper(d, sums[k + 8], sums[k]));
    }
    // Afterwards the four blocks of sums[k] belong to the points k, k + 4, k + 8, k + 12.
    for (int k = 0; k < 4; ++k) {
      sums[k] = hn::Add(hn::OddEvenBlocks(hn::SwapAdjacentBlocks(sums[k + 4]), sums[k]),
                        hn::OddEvenBlocks(sums[k + 4], hn::SwapAdjacentBlocks(sums[k])));
    }
  } else if constexpr (kLanes == 8) {
    for (int k = 0; k < 4; ++k) {
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
#else
  return sums[0];
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
