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

/// A parabola along a stretch of an outline. Its parameter s is the length along `axis`, away from
/// the wall, in cells.
class ContactCurve {
 public:
  Point At(double s) const {
    const double side = c_[0] + s * (c_[1] + s * c_[2]);
    return {origin_.x + s * axis_.x - side * axis_.y, origin_.y + s * axis_.y + side * axis_.x};
  }
  /// The direction of growing s; not a unit vector.
  Point DirectionAt(double s) const {
    const double slope = c_[1] + 2 * c_[2] * s;
    return {axis_.x - slope * axis_.y, axis_.y + slope * axis_.x};
  }
  /// The first fitted point has the length 0, the wall a negative one.
  double s_foot() const { return foot_; }
  /// Number, from the contact, of the first fitted point.
  std::size_t first_point() const { return first_point_; }
  /// Where the curve meets the wall.
  const WallPlace& foot() const { return foot_place_; }

  /// The k-th point from a contact along its free stretch, k >= 1; empty at its end.
  using StretchPoint = absl::FunctionRef<std::optional<Point>(std::size_t k)>;

  /// Walls, and a tile near the contact; kNoTile: no walls are near.
  struct Surroundings {
    const WallField& walls;
    const TileDirectory& directory;
    std::uint32_t tile;
  };

  /// Fits the stretch from 1.5 h above the wall by least squares. Empty if the stretch is too
  /// short, or if the curve does not meet the wall of the contact nearby, in the fluid of the other
  /// walls, at an angle above about ten degrees. `spacing`: h in cells. Cost: linear in the points
  /// and in the lines near the contact.
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
