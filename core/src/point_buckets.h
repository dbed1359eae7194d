// Things at points of the plane, found again by where they are. Only where there are things, memory
// is taken.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "point.h"

namespace partiemc {

/// Things with a Point `at`, sorted by a hash of the square cell in which it lies. Keeps its
/// memory.
template <typename Thing>
class PointBuckets {
 public:
  /// Requires: coordinates of at most 2^60 times `cell`. Cost: linear, serial.
  void Build(std::span<const Thing> things, double cell) {
    per_length_ = 1 / cell;
    const int bits = std::max(1, static_cast<int>(std::bit_width(things.size())));
    shift_ = 64 - bits;
    offsets_.assign((std::size_t{1} << bits) + 1, 0);
    bucket_of_.resize(things.size());
    for (std::size_t k = 0; k < things.size(); ++k) {
      bucket_of_[k] = BucketOf(CellAlong(things[k].at.x), CellAlong(things[k].at.y));
      ++offsets_[bucket_of_[k]];
    }
    // Ends, which become beginnings as the things come in, the last one first.
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    things_.resize(things.size());
    for (std::size_t k = things.size(); k-- > 0;) things_[--offsets_[bucket_of_[k]]] = things[k];
  }

  /// Calls visit(thing) once for all that are less than a cell's width from `p` along each axis,
  /// but for a rounding of the coordinates, and for others; of those that share a bucket for the
  /// `most` that came first to Build. The order depends on the things, theirs, and `p` only.
  /// Requires: Build before.
  template <typename Visit>
  void ForEachNear(Point p, Visit visit,
                   std::uint32_t most = std::numeric_limits<std::uint32_t>::max()) const {
    const std::int64_t column = CellAlong(p.x);
    const std::int64_t row = CellAlong(p.y);
    // Cells may share a bucket: each is looked into once.
    std::array<std::uint32_t, 9> buckets;
    auto end = buckets.begin();
    for (std::int64_t j = row - 1; j <= row + 1; ++j) {
      for (std::int64_t i = column - 1; i <= column + 1; ++i) {
        const std::uint32_t bucket = BucketOf(i, j);
        if (std::find(buckets.begin(), end, bucket) != end) continue;
        *end++ = bucket;
        const std::uint32_t first = offsets_[bucket];
        const std::uint32_t last = first + std::min(most, offsets_[bucket + 1] - first);
        for (std::uint32_t k = first; k < last; ++k) visit(things_[k]);
      }
    }
  }

 private:
  std::int64_t CellAlong(double coordinate) const {
    return static_cast<std::int64_t>(std::floor(coordinate * per_length_));
  }
  // Fibonacci hashing of both numbers of a cell.
  std::uint32_t BucketOf(std::int64_t column, std::int64_t row) const {
    const std::uint64_t mixed = (static_cast<std::uint64_t>(column) * 0x9e3779b97f4a7c15u) ^
                                (static_cast<std::uint64_t>(row) * 0xc2b2ae3d27d4eb4fu);
    return static_cast<std::uint32_t>((mixed * 0x9e3779b97f4a7c15u) >> shift_);
  }

  double per_length_ = 0;
  int shift_ = 63;
  std::vector<std::uint32_t> bucket_of_;  // By thing, in the order in which they came.
  std::vector<std::uint32_t> offsets_;    // Bucket b has things_[offsets_[b], offsets_[b + 1]).
  std::vector<Thing> things_;
};

}  // namespace partiemc
