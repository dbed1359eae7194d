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

// Copies rows of kColumns values. Returns whether any is not 0.
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
    std::memcpy(to, from, kColumns * sizeof(float));  // Inlined, unlike copy_n.
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
  values_.resize(std::size_t{rims} * Size());
}

void DensityHalo::Keep(std::uint32_t tile, const NodeSums& sums) {
  const std::uint32_t at = rim_[tile];
  float* const rim = values_.data() + std::size_t{at} * Size();
  const auto keep_rows = [&](int first, int to) {
    return CopyRows<kSumColumns>(sums.data() + SumIndex(-kSumMargin, first), kSumColumns, rows_,
                                 rim + to);
  };
  const auto keep_side = [&](int first, int to) {
    return CopyRows<kSumMargin>(sums.data() + SumIndex(first, 0), kSumColumns, kTileSize, rim + to);
  };
  parts_[at] = static_cast<std::uint8_t>((keep_rows(-rows_, 0) ? kLower : 0) |
                                         (keep_rows(kTileSize, UpperRows()) ? kUpper : 0) |
                                         (keep_side(-kSumMargin, LeftSide()) ? kLeft : 0) |
                                         (keep_side(kTileSize, RightSide()) ? kRight : 0));
}

void DensityHalo::AddTo(const TileDirectory& directory, std::uint32_t tile, float* values) const {
  const Neighbourhood& neighbours = directory.neighbours(tile);
  for (int place = 0; place < static_cast<int>(neighbours.size()); ++place) {
    const int dx = place % 3 - 1;
    const int dy = place / 3 - 1;
    const std::uint32_t from = neighbours[place];
    if ((dx == 0 && dy == 0) || from == kNoTile || rim_[from] == kNoTile) continue;
    const std::uint8_t part = dy < 0 ? kUpper : dy > 0 ? kLower : dx < 0 ? kRight : kLeft;
    if ((parts_[rim_[from]] & part) == 0) continue;
    const float* const rim = values_.data() + std::size_t{rim_[from]} * Size();
    const float* const rows = rim + (dy < 0 ? UpperRows() : 0);
    float* const to = values + (dy > 0 ? (kTileSize - rows_) * kTileSize : 0) +
                      (dx > 0 ? kTileSize - kSumMargin : 0);
    if (dy == 0) {
      AddRows<kSumMargin>(rim + (dx < 0 ? RightSide() : LeftSide()), kSumMargin, kTileSize, to);
    } else if (dx == 0) {
      AddRows<kTileSize>(rows + kSumMargin, kSumColumns, rows_, to);
    } else {
      AddRows<kSumMargin>(rows + (dx < 0 ? kSumMargin + kTileSize : 0), kSumColumns, rows_, to);
    }
  }
}

}  // namespace partiemc
