// Evaluates the level set and its gradient at any point.
#pragma once

#include <array>
#include <cstdint>

#include "frame/scale.h"
#include "space/bins.h"
#include "space/level_set.h"
#include "space/near_particles.h"
#include "space/point_sums.h"

namespace partiemc::space {

/// F at a point and its gradient. Lengths in cells. With own sizes, the gradient leaves out the
/// gradient of the local size, which does not move roots.
struct PointSample {
  double value = 0;
  Vec3 gradient;
  double size = 1;  ///< The local size, in spacings.
};

/// Collects the particles around a box once for all points in it. Not thread-safe; about 220 kB.
class PointSampler {
 public:
  /// `rows`: rows for cubes of cells, which speed up moves to them, or none. Refers to its
  /// arguments.
  PointSampler(const SpaceBins& bins, const Scale& scale, const NearRows* rows = nullptr)
      : bins_(bins), scale_(scale), rows_(rows) {}

  /// Sets the box that contains the points of later calls, in cells relative to `brick`.
  void MoveTo(std::uint32_t brick, const NearBox& box);

  /// F at a point of the box, relative to the brick.
  double Value(const Vec3& point);

  /// F at a point, and the gradient of the term that determines F there. Gradients are analytic;
  /// the gradient of the gap term uses the derivative of the eigenvalue.
  PointSample Sample(const Vec3& point);

 private:
  bool Select();
  bool IsOnRows();
  template <typename Visit>
  void ForEachBlock(Visit visit);
  template <typename Visit>
  void CollectBlocks(Visit visit);
  Sums Total(const PartialMoments& moments) const;
  Vec3 GradientOf(Term term, const Sums& sums, const Slopes& slopes, const QueryPoint& point);
  Vec3 GradientOfGap(const Sums& sums, const Slopes& slopes, const QueryPoint& point);

  const SpaceBins& bins_;
  const Scale& scale_;
  const NearRows* const rows_;
  std::uint32_t brick_ = 0;
  NearBox box_;
  NearBlock block_;
  std::array<int, 3> corner_{};  // Of the box.
  bool is_on_rows_ = false;      // The box is a cube of `rows_`.
  bool is_whole_ = false;        // All particles around the box are in block_.

  // With own sizes, the particles around the brick, and around the part of it that has the box.
  NearBrick whole_;
  NearPart part_;
  NearBox part_box_;
  bool is_in_brick_ = false;  // `whole_` is of `brick_`, or `part_` is if `whole_` has no room.
  bool has_whole_ = false, has_part_ = false;
};

}  // namespace partiemc::space
