// Looks up rows of bits for many particles at once. Compiled once for each target, hence the guard
// that each of them turns.
#if defined(PARTIEMC_ROW_TABLE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PARTIEMC_ROW_TABLE_INL_H
#undef PARTIEMC_ROW_TABLE_INL_H
#else
#define PARTIEMC_ROW_TABLE_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "bins/lattice.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Looks up rows of a tile by their number, in vectors of up to sixteen.
class RowTable {
 public:
  using Bits = hn::CappedTag<std::int32_t, 16>;
  using Indices = hn::RebindToUnsigned<Bits>;

#if HWY_TARGET <= HWY_AVX3
  // In two registers.
  HWY_INLINE explicit RowTable(const BitRows& rows)
      : lower_(hn::LoadU(Indices(), rows.data())),
        upper_(hn::LoadU(Indices(), rows.data() + kTileSize / 2)) {}

  HWY_INLINE hn::Vec<Bits> operator[](hn::Vec<Bits> row) const {
    const Bits d;
    const auto half = hn::Set(d, kTileSize / 2 - 1);
    const auto place = hn::IndicesFromVec(Indices(), hn::And(row, half));
    const auto is_upper = hn::RebindMask(Indices(), hn::Gt(row, half));
    return hn::BitCast(d, hn::IfThenElse(is_upper, hn::TableLookupLanes(upper_, place),
                                         hn::TableLookupLanes(lower_, place)));
  }

 private:
  hn::Vec<Indices> lower_, upper_;
#else
  HWY_INLINE explicit RowTable(const BitRows& rows)
      : rows_(reinterpret_cast<const std::int32_t*>(rows.data())) {}

  HWY_INLINE hn::Vec<Bits> operator[](hn::Vec<Bits> row) const {
    return hn::GatherIndex(Bits(), rows_, row);
  }

 private:
  const std::int32_t* rows_;
#endif
};

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#endif  // the guard
