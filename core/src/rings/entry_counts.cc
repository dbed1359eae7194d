#include "rings/entry_counts.h"

#include <cstddef>

#include "base/prefetch.h"

#ifndef PARTIEMC_ENTRY_COUNTS_ONCE
#define PARTIEMC_ENTRY_COUNTS_ONCE
namespace partiemc {
namespace {

// How many entries before their turn they are asked for. Those behind the last one belong to the
// tiles that come next.
constexpr std::size_t kEntriesAhead = 256;

}  // namespace
}  // namespace partiemc
#endif

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rings/entry_counts.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "bins/row_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Reads whole vectors, if need be of the entries behind the last one.
std::uint32_t CountEntriesInHere(const BitRows& cells, std::span<const BinnedParticle> entries,
                                 std::uint32_t first, std::uint32_t last) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> d_bits;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const RowTable rows(cells);
  std::uint32_t count = 0;
  for (; first < last && first + lanes <= entries.size(); first += lanes) {
    const std::size_t ahead = first + kEntriesAhead;
    if (ahead + lanes <= entries.size()) PrefetchLines(entries.subspan(ahead, lanes));
    hn::Vec<decltype(d)> x, y, source;
    hn::LoadInterleaved3(d, &entries[first].x, x, y, source);
    // Truncation rounds down: nothing is before its tile.
    const auto row = rows[hn::ConvertTo(d_bits, y)];
    const auto bit = hn::Shl(hn::Set(d_bits, 1), hn::ConvertTo(d_bits, x));
    const auto is_in = hn::And(hn::TestBit(row, bit), hn::FirstN(d_bits, last - first));
    count += static_cast<std::uint32_t>(hn::CountTrue(d_bits, is_in));
  }
  for (; first < last; ++first) count += LiesIn(entries[first], cells);
  return count;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(CountEntriesInHere);

std::uint32_t CountEntriesIn(const BitRows& cells, std::span<const BinnedParticle> entries,
                             std::uint32_t first, std::uint32_t last) {
  return HWY_DYNAMIC_DISPATCH(CountEntriesInHere)(cells, entries, first, last);
}

}  // namespace partiemc
#endif  // HWY_ONCE
