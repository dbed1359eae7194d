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

/// F at a point and its gradient. Lengths are in cells. With own sizes F has the local size as a
/// factor. The gradient leaves out the derivative of this factor, which has no effect where F = 0.
struct PointSample {
  double value = 0;
  Vec3 gradient;
  double size = 1;  ///< The local size, in spacings.
};

/// Collects the particles around a box once for all points in it. Not thread-safe; about 220 kB.
class PointSampler {
 public:
  /// `rows` may be null. With equal sizes, it speeds up MoveTo for cubes of `rows->side()` cells.
  /// Keeps references to its arguments.
  PointSampler(const SpaceBins& bins, const Scale& scale, const NearRows* rows = nullptr)
      : bins_(bins), scale_(scale), rows_(rows) {}

  /// Sets the box that contains the points of later calls, in cells relative to `brick`.
  void MoveTo(std::uint32_t brick, const NearBox& box);

  /// F at a point of the box. The point is in cells relative to the brick.
  double Value(const Vec3& point);

  /// F at a point of the box, and the analytic gradient of the term that has this value. The
  /// gradient is 0 if no kernel reaches the point.
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

  // With own sizes: the particles around the brick, and around the part of it with the box.
  NearBrick whole_;
  NearPart part_;
  NearBox part_box_;
  bool is_in_brick_ = false;  // `has_whole_` and `has_part_` describe `brick_`.
  bool has_whole_ = false, has_part_ = false;
};

}  // namespace partiemc::space
