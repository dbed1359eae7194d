#include "bins/near_entries.h"

#include <algorithm>

#include "base/prefetch.h"

#ifndef PARTIEMC_NEAR_ENTRIES_ONCE
#define PARTIEMC_NEAR_ENTRIES_ONCE
namespace partiemc {
namespace {

// The entries [first, last) of a tile, those in `cells` of it; relative to another tile they are
// shifted.
struct ListPart {
  std::span<const BinEntry> entries;
  std::uint32_t first, last;
  const BitRows& cells;
  float shift_x, shift_y;
};

// Entries between those that are looked at and those whose memory is asked for.
constexpr std::uint32_t kAskedAhead = 128;

}  // namespace
}  // namespace partiemc
#endif

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bins/near_entries.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "base/compressor-inl.h"
#include "bins/row_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, NearEntries::kPadding>;
using Indices = hn::RebindToUnsigned<Lanes>;
using Bits = hn::RebindToSigned<Lanes>;

// Adds the chosen entries to `near`. Reads whole vectors, if need be of the entries behind them.
template <NearFields kFields>
void ChooseFields(const ListPart& part, NearEntries& near) {
  const Lanes d;
  const Bits d_bits;
  const Indices d_index;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const RowTable rows(part.cells);
  const auto lane = hn::Iota(d_index, 0);
  const auto [entries, start, last, cells, shift_x, shift_y] = part;
  std::uint32_t first = start;
  int chosen = near.count;
  for (; first < last && first + lanes <= entries.size(); first += lanes) {
    const std::size_t later = std::min<std::size_t>(first + kAskedAhead, entries.size() - lanes);
    PrefetchLines(entries.subspan(later, lanes));
    hn::Vec<Lanes> x, y, source;
    hn::LoadInterleaved3(d, &entries[first].x, x, y, source);
    // Truncation rounds down: nothing is before its tile.
    const auto row = rows[hn::ConvertTo(d_bits, y)];
    const auto bit = hn::Shl(hn::Set(d_bits, 1), hn::ConvertTo(d_bits, x));
    const auto is_in = hn::And(hn::TestBit(row, bit), hn::FirstN(d_bits, last - first));
    const Compressor compress(is_in);
    hn::StoreU(compress(d, hn::Add(x, hn::Set(d, shift_x))), d, near.x.data() + chosen);
    hn::StoreU(compress(d, hn::Add(y, hn::Set(d, shift_y))), d, near.y.data() + chosen);
    if constexpr (kFields == NearFields::kAll) {
      hn::StoreU(compress(d_index, hn::Add(hn::Set(d_index, first), lane)), d_index,
                 near.entry.data() + chosen);
    }
    chosen += static_cast<int>(hn::CountTrue(d_bits, is_in));
  }
  for (; first < last; ++first) {
    const BinEntry& entry = entries[first];
    near.x[chosen] = entry.x + shift_x;
    near.y[chosen] = entry.y + shift_y;
    near.entry[chosen] = first;
    chosen += LiesIn(entry, cells);
  }
  near.count = chosen;
}

void ChooseEntries(const ListPart& part, NearFields fields, NearEntries& near) {
  fields == NearFields::kAll ? ChooseFields<NearFields::kAll>(part, near)
                             : ChooseFields<NearFields::kPositions>(part, near);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(ChooseEntries);

NearWalk::NearWalk(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask,
                   NearFields fields)
    : entries_(bins.entries), fields_(fields) {
  const Neighbourhood& neighbours = bins.tiles.neighbours(tile);
  const unsigned places = mask != nullptr ? NeighboursWithCells(*mask) : ~0u;
  for (int place = 0; place < kMaxLists; ++place) {
    const std::uint32_t from = neighbours[place];
    if ((places >> place & 1) == 0 || from == kNoTile || bins.CountOf(from) == 0) continue;
    List& list = lists_[list_count_++];
    if (mask != nullptr) {
      list.cells = CellsOfNeighbour(*mask, place);
    } else {
      list.cells.fill(~std::uint32_t{0});
    }
    list.next = bins.offsets[from];
    list.end = bins.offsets[from + 1];
    list.shift_x = static_cast<float>((place % 3 - 1) * kTileSize);
    list.shift_y = static_cast<float>((place / 3 - 1) * kTileSize);
  }
}

NearWalk::NearWalk(const ParticleBins& bins, std::uint32_t tile, const BitRows& cells,
                   NearFields fields)
    : entries_(bins.entries), fields_(fields), list_count_(1) {
  lists_.front() = {.next = bins.offsets[tile],
                    .end = bins.offsets[tile + 1],
                    .cells = cells,
                    .shift_x = 0,
                    .shift_y = 0};
}

// Chooses entries until the block is full. Returns false if there are no more.
bool NearWalk::ChooseMore() {
  chosen_.count = 0;
  for (; list_ < list_count_; ++list_) {
    List& list = lists_[list_];
    while (list.next < list.end) {
      const int room = NearEntries::kCapacity - chosen_.count;
      if (room < kLeastRoom) return true;
      const std::uint32_t last =
          list.next + std::min(static_cast<std::uint32_t>(room), list.end - list.next);
      const ListPart part{entries_, list.next, last, list.cells, list.shift_x, list.shift_y};
      HWY_DYNAMIC_DISPATCH(ChooseEntries)(part, fields_, chosen_);
      list.next = last;
    }
  }
  return chosen_.count > 0;
}

}  // namespace partiemc
#endif  // HWY_ONCE
