// Where the particles near a virtual plane put the boundary (core/METHOD.md, "The default
// placement", 3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "plane_support.h"
#include "point_field.h"
#include "scale.h"

namespace partiemc {

/// How far outside of a plane the boundary is, in cells; each at most 0.8 spacings either way. 0
/// where there is nothing to tell it by.
struct PlaneEstimates {
  double support = 0;  ///< By the outermost particles' mean distance to it, plus half a spacing.
  double strip = 0;    ///< By the particles' volume in a strip below it.
};

/// Estimates planes of one field.
class PlaneEstimator {
 public:
  PlaneEstimator(const PointField& field, const Scale& scale);

  /// Planes at one or two points of a tile, in cells relative to it, neighbours at best.
  struct Planes {
    std::uint32_t tile = kNoTile;
    std::array<BentPlane, kPointsAtOnce> planes;
    std::size_t count = 0;
  };
  using Estimates = std::array<PlaneEstimates, kPointsAtOnce>;

  /// Of at most kQueriesAtOnce. Cost: the particles within three spacings of each.
  /// Requires: field.Covers(tile, x, y) of each; planes and estimates are as many.
  void Estimate(std::span<const Planes> planes, std::span<Estimates> estimates) const;

 private:
  PlaneEstimates EstimatesOf(const SupportSums& sums) const;

  const PointField& field_;
  const Scale& scale_;
  SupportShape support_;
  StripShape strip_;
};

/// Planes of successive vertices, collected to be estimated at once: two of a segment that lie in
/// one tile look at the same particles.
class PlaneQueries {
 public:
  explicit PlaneQueries(const PlaneEstimator& estimator) : estimator_(estimator) {}

  /// Whether there may be no room for the two planes of another segment.
  bool IsFull() const { return count_ + 2 > kQueriesAtOnce; }

  /// Vertices come in their order; those of segment k are 2 k and 2 k + 1.
  /// Requires: !IsFull() before the first of a segment's; the field covers the plane's point.
  void Add(std::ptrdiff_t vertex, std::uint32_t tile, const BentPlane& plane) {
    const bool joins = count_ > 0 && vertex % 2 == 1 && vertices_[count_ - 1] == vertex - 1 &&
                       planes_[count_ - 1].tile == tile;
    if (!joins) {
      planes_[count_].tile = tile;
      planes_[count_].count = 0;
      vertices_[count_++] = vertex;
    }
    PlaneEstimator::Planes& of = planes_[count_ - 1];
    of.planes[of.count++] = plane;
  }

  /// Calls visit(vertex, estimates) for all that were added, and forgets them.
  template <typename Visit>
  void Run(Visit visit) {
    if (count_ == 0) return;
    std::array<PlaneEstimator::Estimates, kQueriesAtOnce> estimates;
    estimator_.Estimate(std::span(planes_).first(count_), estimates);
    for (std::size_t q = 0; q < count_; ++q) {
      for (std::size_t k = 0; k < planes_[q].count; ++k) {
        visit(vertices_[q] + static_cast<std::ptrdiff_t>(k), estimates[q][k]);
      }
    }
    count_ = 0;
  }

 private:
  const PlaneEstimator& estimator_;
  std::array<PlaneEstimator::Planes, kQueriesAtOnce> planes_;
  std::array<std::ptrdiff_t, kQueriesAtOnce> vertices_;  // The first of each.
  std::size_t count_ = 0;
};

}  // namespace partiemc
