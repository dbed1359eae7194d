#include "sum_rims.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace partiemc {
namespace {

template <int kColumns>
void AddRows(const float* from, int stride, int rows, float* to) {
  for (int row = 0; row < rows; ++row, from += stride, to += kTileSize) {
    for (int column = 0; column < kColumns; ++column) to[column] += from[column];
  }
}

}  // namespace

void SumRims::Prepare(const ParticleBins& bins, float radius) {
  rows_ = static_cast<int>(std::ceil(radius));
  rim_.resize(bins.tiles.size());
  std::uint32_t rims = 0;
  for (std::size_t tile = 0; tile < rim_.size(); ++tile) {
    rim_[tile] = bins.CountOf(tile) > 0 ? rims++ : kNoTile;
  }
  values_.resize(std::size_t{rims} * Size());
}

void SumRims::Keep(std::uint32_t tile, const NodeSums& sums) {
  float* const rim = values_.data() + std::size_t{rim_[tile]} * Size();
  const int row_values = rows_ * kSumColumns;
  std::copy_n(sums.data() + SumIndex(-kSumMargin, -rows_), row_values, rim);
  std::copy_n(sums.data() + SumIndex(-kSumMargin, kTileSize), row_values, rim + UpperRows());
  for (int j = 0; j < kTileSize; ++j) {
    std::copy_n(sums.data() + SumIndex(-kSumMargin, j), kSumMargin,
                rim + LeftSide() + j * kSumMargin);
    std::copy_n(sums.data() + SumIndex(kTileSize, j), kSumMargin,
                rim + RightSide() + j * kSumMargin);
  }
}

void SumRims::AddTo(const TileDirectory& directory, std::uint32_t tile, float* values) const {
  const Neighbourhood& neighbours = directory.neighbours(tile);
  for (int place = 0; place < static_cast<int>(neighbours.size()); ++place) {
    const int dx = place % 3 - 1;
    const int dy = place / 3 - 1;
    const std::uint32_t from = neighbours[place];
    if ((dx == 0 && dy == 0) || from == kNoTile || rim_[from] == kNoTile) continue;
    const float* const rim = values_.data() + std::size_t{rim_[from]} * Size();
    float* const to = values + (dy > 0 ? (kTileSize - rows_) * kTileSize : 0) +
                      (dx > 0 ? kTileSize - kSumMargin : 0);
    if (dy == 0) {
      AddRows<kSumMargin>(rim + (dx < 0 ? RightSide() : LeftSide()), kSumMargin, kTileSize, to);
      continue;
    }
    const float* const rows = rim + (dy < 0 ? UpperRows() : 0);
    if (dx == 0) {
      AddRows<kTileSize>(rows + kSumMargin, kSumColumns, rows_, to);
    } else {
      AddRows<kSumMargin>(rows + (dx < 0 ? kSumMargin + kTileSize : 0), kSumColumns, rows_, to);
    }
  }
}

}  // namespace partiemc
