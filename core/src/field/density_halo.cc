#include "field/density_halo.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>

namespace partiemc {
namespace {

template <int kColumns>
void AddRows(const float* from, int stride, int rows, float* to) {
  for (int row = 0; row < rows; ++row, from += stride, to += kTileSize) {
    for (int column = 0; column < kColumns; ++column) to[column] += from[column];
  }
}

// Copies `count` rows of kColumns values each. Returns whether any is not 0.
template <int kColumns>
bool CopyRows(const float* from, int stride, int rows, float* to) {
  std::uint32_t any = 0;
  for (int row = 0; row < rows; ++row, from += stride) {
    for (int column = 0; column < kColumns; ++column) {
      any |= std::bit_cast<std::uint32_t>(from[column]);
    }
  }
  if (any == 0) return false;
  from -= rows * stride;
  for (int row = 0; row < rows; ++row, from += stride, to += kColumns) {
    std::memcpy(to, from, kColumns * sizeof(float));  // Without a call, unlike copy_n.
  }
  return true;
}

}  // namespace

void DensityHalo::Prepare(const ParticleBins& bins, float radius) {
  rows_ = static_cast<int>(std::ceil(radius));
  rim_.resize(bins.tiles.size());
  std::uint32_t rims = 0;
  for (std::size_t tile = 0; tile < rim_.size(); ++tile) {
    rim_[tile] = bins.CountOf(tile) > 0 ? rims++ : kNoTile;
  }
  parts_.resize(rims);
  own_rows_.resize(rims);
  values_.resize(std::size_t{rims} * Size());
}

void DensityHalo::Keep(std::uint32_t tile, const NodeSums& sums, NodeRange rows) {
  const std::uint32_t at = rim_[tile];
  float* const rim = values_.data() + std::size_t{at} * Size();
  const NodeRange own = {std::max(rows.first, 0), std::min(rows.last, kTileSize - 1)};
  own_rows_[at] = own;
  const auto keep_rows = [&](int first, float* to) {
    return CopyRows<kSumColumns>(sums.data() + SumIndex(-kSumMargin, first), kSumColumns, rows_,
                                 to);
  };
  const auto keep_side = [&](int first, float* to) {
    return CopyRows<kSumMargin>(sums.data() + SumIndex(first, own.first), kSumColumns,
                                own.last - own.first + 1, to + own.first * kSumMargin);
  };
  parts_[at] = static_cast<std::uint8_t>(
      (rows.first < 0 && keep_rows(-rows_, rim) ? kLower : 0) |
      (rows.last >= kTileSize && keep_rows(kTileSize, rim + UpperRows()) ? kUpper : 0) |
      (keep_side(-kSumMargin, rim + LeftSide()) ? kLeft : 0) |
      (keep_side(kTileSize, rim + RightSide()) ? kRight : 0));
}

template <typename Visit>
void DensityHalo::ForEachPart(const TileDirectory& directory, std::uint32_t tile,
                              Visit visit) const {
  const Neighbourhood& neighbours = directory.neighbours(tile);
  for (int place = 0; place < static_cast<int>(neighbours.size()); ++place) {
    const int dx = place % 3 - 1;
    const int dy = place / 3 - 1;
    const std::uint32_t from = neighbours[place];
    if ((dx == 0 && dy == 0) || from == kNoTile || rim_[from] == kNoTile) continue;
    const std::uint8_t part = dy < 0 ? kUpper : dy > 0 ? kLower : dx < 0 ? kRight : kLeft;
    if ((parts_[rim_[from]] & part) != 0) visit(rim_[from], dx, dy);
  }
}

NodeRange DensityHalo::RowsReached(const TileDirectory& directory, std::uint32_t tile) const {
  NodeRange rows = OwnRows(tile);
  ForEachPart(directory, tile, [&](std::uint32_t from, int, int dy) {
    const NodeRange theirs = dy == 0  ? own_rows_[from]
                             : dy < 0 ? NodeRange{0, rows_ - 1}
                                      : NodeRange{kTileSize - rows_, kTileSize - 1};
    rows = {std::min(rows.first, theirs.first), std::max(rows.last, theirs.last)};
  });
  return rows;
}

void DensityHalo::AddTo(const TileDirectory& directory, std::uint32_t tile, float* values) const {
  ForEachPart(directory, tile, [&](std::uint32_t from, int dx, int dy) {
    const float* const rim = values_.data() + std::size_t{from} * Size();
    float* const to = values + (dy > 0 ? (kTileSize - rows_) * kTileSize : 0) +
                      (dx > 0 ? kTileSize - kSumMargin : 0);
    if (dy == 0) {
      const NodeRange rows = own_rows_[from];
      AddRows<kSumMargin>(rim + (dx < 0 ? RightSide() : LeftSide()) + rows.first * kSumMargin,
                          kSumMargin, rows.last - rows.first + 1, to + rows.first * kTileSize);
      return;
    }
    const float* const rows = rim + (dy < 0 ? UpperRows() : 0);
    if (dx == 0) {
      AddRows<kTileSize>(rows + kSumMargin, kSumColumns, rows_, to);
    } else {
      AddRows<kSumMargin>(rows + (dx < 0 ? kSumMargin + kTileSize : 0), kSumColumns, rows_, to);
    }
  });
}

}  // namespace partiemc
