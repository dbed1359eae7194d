// The level set and its gradient at any point near the isoline, not only at nodes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins.h"
#include "crossings.h"
#include "scale.h"

namespace partiemc {

/// F, phi and their gradients at a point, in cells (gradients are without unit).
struct FieldSample {
  double density = 0;                     ///< f
  double mean_x = 0, mean_y = 0;          ///< xbar - x, the weighted mean relative to the point.
  double phi = 0;                         ///< |x - xbar| - r
  double phi_x = 0, phi_y = 0;            ///< grad phi; 0 where x = xbar.
  double value = 0;                       ///< F = max(phi, (g - f) R / 1.164)
  double gradient_x = 0, gradient_y = 0;  ///< grad F, of the larger branch.
  bool has_support = false;               ///< Whether any particle is within the kernel radius.
};

/// Particles of the tiles near the isoline, sorted into buckets of about a cell, so that a point
/// looks at its surroundings instead of its whole tile.
class PointField {
 public:
  /// Indexes the tiles that have active cells; with `neighbours`, those next to them too.
  /// Cost: linear in the entries of those tiles.
  void Build(const ParticleBins& bins, const Crossings& crossings, const Scale& scale,
             bool neighbours);

  /// Samples at a point of an indexed tile, in cells relative to the tile, 0 <= x, y <= 32.
  /// Deterministic: particles are summed by bucket, then in the order of the bins.
  /// Cost: the particles within a kernel radius and a bucket.
  FieldSample Sample(std::uint32_t tile, double x, double y) const;

  /// Calls visit(x, y, entry) for the particles of `tile`'s list within `radius` of a point of it,
  /// and for some more. Requires: radius <= kernel radius.
  template <typename Visit>
  void ForEachNear(std::uint32_t tile, double x, double y, double radius, Visit visit) const;

  /// Index in the frame of the particle of an entry.
  std::uint32_t SourceOf(std::uint32_t entry) const { return source_[entry]; }

  bool IsIndexed(std::uint32_t tile) const { return first_bucket_[tile] != kNoTile; }

 private:
  struct BucketRange {
    int first, last;  // Inclusive.
  };
  BucketRange Buckets(double centre, double radius) const;

  void MarkTiles(const ParticleBins& bins, const Crossings& crossings, bool neighbours);
  void SortTile(const ParticleBins& bins, std::uint32_t tile);

  Scale scale_;
  double bucket_size_ = 1;  // Cells.
  double margin_ = 0;       // Cells that buckets extend beyond the tile on each side.
  int bucket_columns_ = 0;
  std::vector<std::uint32_t> first_bucket_;  // Per tile: into bucket_offsets_, or kNoTile.
  std::vector<std::uint32_t> first_entry_;   // Per tile: into the arrays below.
  std::vector<std::uint32_t> bucket_offsets_;
  std::vector<float> x_, y_, weight_;
  std::vector<std::uint32_t> source_;
};

template <typename Visit>
void PointField::ForEachNear(std::uint32_t tile, double x, double y, double radius,
                             Visit visit) const {
  const BucketRange columns = Buckets(x, radius);
  const BucketRange rows = Buckets(y, radius);
  for (int row = rows.first; row <= rows.last; ++row) {
    const std::uint32_t* offsets =
        bucket_offsets_.data() + first_bucket_[tile] + row * bucket_columns_;
    for (std::uint32_t e = offsets[columns.first]; e < offsets[columns.last + 1]; ++e) {
      visit(static_cast<double>(x_[e]), static_cast<double>(y_[e]), e);
    }
  }
}

}  // namespace partiemc
