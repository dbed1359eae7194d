// The level set and its gradient at any point near the isoline, not only at nodes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "bins.h"
#include "bucket_grid.h"
#include "crossings.h"
#include "near_entries.h"
#include "point_kernels.h"
#include "scale.h"

namespace partiemc {

/// F, phi and their gradients at a point, in cells (gradients are without unit).
struct FieldSample {
  double density = 0;                     ///< f
  double mean_x = 0, mean_y = 0;          ///< xbar - x, the weighted mean relative to the point.
  double phi = 0;                         ///< |x - xbar| - r
  double phi_x = 0, phi_y = 0;            ///< grad phi; 0 where x = xbar.
  double spread = 0;                      ///< s
  double value = 0;                       ///< F (level_set_formula.h)
  double gradient_x = 0, gradient_y = 0;  ///< grad F, of the branch that F is.
  bool has_support = false;               ///< Whether any particle is within the kernel radius.
};

/// A point of a tile, in cells relative to it; in tile kNoTile where no particle is near.
struct FieldPoint {
  std::uint32_t tile = kNoTile;
  double x = 0, y = 0;
};

/// One or two points of a tile, in cells relative to it, and what the field is there.
struct FieldPoints {
  std::uint32_t tile = kNoTile;
  std::array<LatticePoint, kPointsAtOnce> points;
  std::size_t count = 0;
};
using FieldSamples = std::array<FieldSample, kPointsAtOnce>;

/// Particles near the isoline, sorted into buckets of about a cell, so that a point
/// looks at its surroundings instead of its whole tile.
class PointField {
 public:
  /// Indexes what points in active cells ask for, and points in cells that are up to `wander`
  /// cells away from one, along each axis. Cost: linear in the entries of those cells' tiles.
  void Build(const ParticleBins& bins, const Crossings& crossings, const Scale& scale,
             double wander);

  /// Samples at a point of a tile, in cells relative to the tile, 0 <= x, y <= 32.
  /// Requires: the tile is indexed. Particles miss where Covers is false.
  /// Deterministic: particles are summed in the order of buckets, then of the bins (SumAtPoints).
  /// Cost: the particles within a kernel radius and a bucket.
  FieldSample Sample(std::uint32_t tile, double x, double y) const;

  /// The same of points of at most kQueriesAtOnce places, for less than one after the other. Those
  /// of a place look at the same particles: neighbours at best.
  void Sample(std::span<const FieldPoints> places, std::span<FieldSamples> samples) const;

  /// Whether particles weigh each their own.
  bool HasWeights() const { return !weight_.empty(); }

  /// Calls visit(x, y, entry) for the particles of `tile`'s list within `radius` of a point of it,
  /// and for some more. Requires: radius <= kernel radius.
  template <typename Visit>
  void ForEachNear(std::uint32_t tile, double x, double y, double radius, Visit visit) const;

  /// The particles within `radius` of any of some points, for a kernel of vectors. All of
  /// `points` in cells relative to the tile.
  NearRows RowsNear(std::uint32_t tile, std::span<const LatticePoint> points, double radius) const;

  /// Index in the frame of the particle of an entry.
  std::uint32_t SourceOf(std::uint32_t entry) const { return source_[entry]; }

  bool IsIndexed(std::uint32_t tile) const { return boxes_[tile].rows > 0; }

  /// Whether a point of a tile, 0 <= x, y < 32, is near enough to an active cell.
  bool Covers(std::uint32_t tile, double x, double y) const {
    return IsIndexed(tile) && (asked_[tile][static_cast<int>(y)] >> static_cast<int>(x) & 1) != 0;
  }

 private:
  // The buckets of a tile within `radius` of a box, as far as they have entries.
  BucketBox BucketsNear(std::uint32_t tile, const LatticePoint& low, const LatticePoint& high,
                        double radius) const;
  // The first bucket of a row of such a box.
  const std::uint32_t* RowOf(std::uint32_t tile, const BucketBox& near, int row) const {
    const BucketBox& box = boxes_[tile];
    return bucket_offsets_.data() + first_bucket_[tile] + (near.row + row - box.row) * box.columns +
           near.column - box.column;
  }

  PointKernel Kernel() const {
    return {1 / (scale_.kernel_radius * scale_.kernel_radius), scale_.uniform_weight};
  }
  FieldSample SampleOf(const NearRows& near, const LatticePoint& point,
                       const PointSums& sums) const;
  void MarkTiles(const ParticleBins& bins, const Crossings& crossings, double wander);
  std::span<std::uint32_t> OffsetsOf(std::uint32_t tile);
  bool HasMasks() const { return Reach() < kMaskMargin; }
  int Reach() const { return static_cast<int>(std::ceil(scale_.kernel_radius)); }
  NearWalk Near(const ParticleBins& bins, std::uint32_t tile, NearFields fields) const;
  std::uint32_t CountEntries(const ParticleBins& bins, std::uint32_t tile);
  void FillEntries(const ParticleBins& bins, std::uint32_t tile);

  Scale scale_;
  BucketGrid grid_;
  std::vector<BitRows> asked_;               // Per tile: the cells in which points may lie.
  std::vector<BucketBox> boxes_;             // Per tile: buckets that may have entries.
  std::vector<std::uint32_t> first_bucket_;  // Per tile: the first of these in bucket_offsets_.
  std::vector<std::uint32_t> first_entry_;   // Per tile: into the arrays of entries.
  std::vector<std::uint32_t> bucket_offsets_;
  std::vector<float> x_, y_, weight_;
  std::vector<std::uint32_t> source_;
};

inline BucketBox PointField::BucketsNear(std::uint32_t tile, const LatticePoint& low,
                                         const LatticePoint& high, double radius) const {
  const BucketBox& box = boxes_[tile];
  BucketBox near;
  const auto clip = [&](double from, double to, int begin, int count, int& first, int& size) {
    first = std::max(grid_.Along(from - radius), begin);
    size = std::min(grid_.Along(to + radius), begin + count - 1) - first + 1;
  };
  clip(low.x, high.x, box.column, box.columns, near.column, near.columns);
  clip(low.y, high.y, box.row, box.rows, near.row, near.rows);
  const bool any = near.columns > 0 && near.rows > 0;
  return any ? near : BucketBox{.column = box.column, .row = box.row};
}

inline NearRows PointField::RowsNear(std::uint32_t tile, std::span<const LatticePoint> points,
                                     double radius) const {
  LatticePoint low = points.front(), high = points.front();
  for (const LatticePoint& point : points.subspan(1)) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
  // What lies on the rim, or nearer to it than positions are to each other, adds nothing to a sum.
  const BucketBox near = BucketsNear(tile, low, high, radius - BucketGrid::kStep / 2);
  return {.x = x_.data(),
          .y = y_.data(),
          .weight = weight_.empty() ? nullptr : weight_.data(),
          .offsets = RowOf(tile, near, 0),
          .rows = near.rows,
          .columns = near.columns,
          .row_stride = boxes_[tile].columns,
          .origin_x = static_cast<float>(static_cast<int>(low.x)),
          .origin_y = static_cast<float>(static_cast<int>(low.y))};
}

template <typename Visit>
void PointField::ForEachNear(std::uint32_t tile, double x, double y, double radius,
                             Visit visit) const {
  const BucketBox near = BucketsNear(tile, {x, y}, {x, y}, radius);
  for (int row = 0; row < near.rows; ++row) {
    const std::uint32_t* offsets = RowOf(tile, near, row);
    for (std::uint32_t e = offsets[0]; e < offsets[near.columns]; ++e) {
      visit(static_cast<double>(x_[e]), static_cast<double>(y_[e]), e);
    }
  }
}

}  // namespace partiemc
