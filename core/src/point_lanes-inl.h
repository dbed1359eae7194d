// The vectors of doubles in which sums over particles at a point run: four partial sums, however
// wide the vectors of the processor are (point_kernels.h), those of two points side by side where
// they have eight lanes. Compiled once for each target, hence the guard that each of them turns.
#if defined(PARTIEMC_POINT_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_POINT_LANES_INL_H
#undef PARTIEMC_POINT_LANES_INL_H
#else
#define PARTIEMC_POINT_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>

#include "point_kernels.h"

#undef PARTIEMC_TWO_POINTS_FIT

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row of entries.
struct EntrySpan {
  std::uint32_t first, last;
};

template <typename Query>
HWY_INLINE EntrySpan RowOf(const Query& query, int row) {
  if (row >= query.rows) return {};
  const std::uint32_t* offsets = query.offsets + row * query.row_stride;
  return {offsets[0], offsets[query.columns]};
}

// The sums of one point: a group of four entries of a row is as many vectors as fill four lanes.
template <typename Query>
class OnePoint {
 public:
  using D = hn::CappedTag<double, kPointPadding>;
  using Vector = hn::Vec<D>;
  static constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
  static constexpr int kParts = kPointPadding / kLanes;
  static constexpr int kPoints = 1;

  HWY_INLINE explicit OnePoint(const Query& query) : query_(query) {}

  template <typename Value>
  HWY_INLINE Vector PerPoint(Value value) const {
    return hn::Set(D(), value(query_));
  }

  // Calls visit(part) for each vector of each group, `Load` and `IsEntry` meaning those of it.
  template <typename Visit>
  HWY_INLINE void ForEachVector(Visit visit) {
    for (int row = 0; row < query_.rows; ++row) {
      const EntrySpan span = RowOf(query_, row);
      for (std::uint32_t entry = span.first; entry < span.last; entry += kPointPadding) {
        for (int part = 0; part < kParts; ++part) {
          entry_ = entry + part * kLanes;
          left_ = static_cast<int>(span.last - entry) - part * kLanes;
          visit(part);
        }
      }
    }
  }

  HWY_INLINE Vector Load(const float* values) const {
    return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), values + entry_));
  }
  // Lanes past the end of the row hold other entries, or none.
  HWY_INLINE hn::Mask<D> IsEntry() const {
    return hn::Lt(hn::Iota(D(), 0.0), hn::Set(D(), static_cast<double>(left_)));
  }

 private:
  const Query& query_;
  std::uint32_t entry_ = 0;
  int left_ = 0;
};

#if HWY_TARGET <= HWY_AVX3
#define PARTIEMC_TWO_POINTS_FIT 1
// The sums of two points, which look at the same arrays: lanes of the first, then of the second.
// Where a row of one has fewer groups, nothing is added to its sums.
template <typename Query>
class TwoPoints {
 public:
  using D = hn::CappedTag<double, 2 * kPointPadding>;
  using Vector = hn::Vec<D>;
  static constexpr int kParts = 1;
  static constexpr int kPoints = 2;

  HWY_INLINE TwoPoints(const Query& first, const Query& second) : first_(first), second_(second) {}

  template <typename Value>
  HWY_INLINE Vector PerPoint(Value value) const {
    const hn::Half<D> d;
    return hn::Combine(D(), hn::Set(d, value(second_)), hn::Set(d, value(first_)));
  }

  template <typename Visit>
  HWY_INLINE void ForEachVector(Visit visit) {
    for (int row = 0; row < std::max(first_.rows, second_.rows); ++row) {
      const EntrySpan a = RowOf(first_, row);
      const EntrySpan b = RowOf(second_, row);
      const std::uint32_t count = std::max(a.last - a.first, b.last - b.first);
      for (std::uint32_t at = 0; at < count; at += kPointPadding) {
        SetEntries(a, at, 0);
        SetEntries(b, at, 1);
        visit(0);
      }
    }
  }

  HWY_INLINE Vector Load(const float* values) const {
    const hn::Rebind<float, hn::Half<D>> d;
    return hn::PromoteTo(D(), hn::Combine(hn::Rebind<float, D>(), hn::LoadU(d, values + entry_[1]),
                                          hn::LoadU(d, values + entry_[0])));
  }
  HWY_INLINE hn::Mask<D> IsEntry() const {
    // As many ones as entries are left.
    static constexpr double kOnes[2 * kPointPadding] = {1, 1, 1, 1};
    const hn::Half<D> d;
    const auto ones = hn::Combine(D(), hn::LoadU(d, kOnes + kPointPadding - left_[1]),
                                  hn::LoadU(d, kOnes + kPointPadding - left_[0]));
    return hn::Gt(ones, hn::Zero(D()));
  }

 private:
  HWY_INLINE void SetEntries(EntrySpan span, std::uint32_t at, int point) {
    entry_[point] = std::min(span.first + at, span.last);
    left_[point] = std::min<std::uint32_t>(span.last - entry_[point], kPointPadding);
  }

  const Query& first_;
  const Query& second_;
  std::uint32_t entry_[2] = {}, left_[2] = {};
};

#else
#define PARTIEMC_TWO_POINTS_FIT 0
#endif

// Adds up the partial sums of two channels: writes the first point's totals to totals[0] and
// totals[1], the second's kPointPadding further.
template <class D, int kParts>
HWY_INLINE void StoreTotals([[maybe_unused]] D d, const hn::Vec<D> (&first)[kParts],
                            const hn::Vec<D> (&second)[kParts], double* totals) {
#if HWY_TARGET == HWY_SCALAR
  const auto total = [](const hn::Vec<D>(&parts)[kParts]) HWY_ATTR {
    return hn::GetLane(hn::Add(hn::Add(parts[0], parts[1]), hn::Add(parts[2], parts[3])));
  };
  totals[0] = total(first);
  totals[1] = total(second);
#else
  // Lanes 0 and 1 of the four, then 2 and 3: in one vector, or each in its own.
  hn::Vec<D> pairs[kParts];
  for (int part = 0; part < kParts; ++part) {
    pairs[part] = hn::Add(hn::InterleaveLower(d, first[part], second[part]),
                          hn::InterleaveUpper(d, first[part], second[part]));
  }
  if constexpr (kParts == 1) {
    hn::StoreU(hn::Add(pairs[0], hn::SwapAdjacentBlocks(pairs[0])), d, totals);
  } else {
    hn::StoreU(hn::Add(pairs[0], pairs[1]), d, totals);
  }
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
