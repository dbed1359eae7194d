// The curve along which an outline continues to a wall.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/functional/function_ref.h"
#include "base/point.h"
#include "walls/wall_field.h"

namespace partiemc {

/// A parabola, or a line for few points, along a free stretch: a part of an outline that is on no
/// wall. In cells from the origin of the world. The parameter s, in cells, is the length along the
/// chord of the fitted points. s grows away from the wall and is 0 at the first fitted point.
class ContactCurve {
 public:
  Point At(double s) const {
    const double side = c_[0] + s * (c_[1] + s * c_[2]);
    return {origin_.x + s * axis_.x - side * axis_.y, origin_.y + s * axis_.y + side * axis_.x};
  }
  /// The direction of growing s; not of unit length.
  Point DirectionAt(double s) const {
    const double slope = c_[1] + 2 * c_[2] * s;
    return {axis_.x - slope * axis_.y, axis_.y + slope * axis_.x};
  }
  /// s where the curve meets the wall; negative.
  double s_foot() const { return foot_; }
  /// The first fitted point is this many points from the contact.
  std::size_t first_point() const { return first_point_; }
  /// Where the curve meets the wall.
  const WallPlace& foot() const { return foot_place_; }

  /// The k-th point from a contact along its free stretch, k >= 1; empty beyond the last one.
  using StretchPoint = absl::FunctionRef<std::optional<Point>(std::size_t k)>;

  /// Walls, and the tile of the contact (WallVertices::tile).
  struct Surroundings {
    const WallField& walls;
    const TileDirectory& directory;
    std::uint32_t tile;
  };

  /// Fits a curve by least squares to the part of the stretch from 1.5 h above the wall, up to 6 h
  /// long. `spacing`: h, the spacing times the local size, in cells. Empty if this part is too
  /// short, or if the curve does not meet the wall nearby at ten degrees or more. Empty also if
  /// another solid covers the wall between the contact and the foot, the point where the curve
  /// meets the wall. Cost: linear in the points and in the lines near the contact.
  static std::optional<ContactCurve> Fit(const Surroundings& around, const WallPlace& contact,
                                         double spacing, StretchPoint point);

 private:
  bool FindFoot(const WallLines& lines, const WallPlace& contact, double spacing);

  Point origin_, axis_;
  std::array<double, 3> c_{};
  double foot_ = 0;
  std::size_t first_point_ = 0;
  WallPlace foot_place_;
};

}  // namespace partiemc
