// Gauges: measurements of an outline, such as the height of a free surface or a contact angle.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/result.h"

namespace partiemc {

enum class GaugeKind {
  /// Free surface above a position x: `highest`, `lowest` crossing of the outline with the vertical
  /// line at x, number of `crossings`. Numbers: x.
  kHeight,
  /// Farthest point of the outline along a direction: its `position` (distance from the origin
  /// along
  /// the direction), `x`, `y`. Numbers: dx, dy.
  kFront,
  /// `length` of a line segment that lies inside the outline. Numbers: x0, y0, x1, y1.
  kWetted,
  /// `area` and centroid (`x`, `y`) of the inside of the outline in a box. Numbers: min_x, min_y,
  /// max_x, max_y.
  kBox,
  /// Contact of the largest body with a straight wall through (x, y) with the direction (dx, dy)
  /// and
  /// the body on its left: `start_angle`, `end_angle` in degrees, measured inside the body, and
  /// `start`, `end`, the coordinates of both contact points along the wall from (x, y). A circle is
  /// fitted to the outline within `reach` of each contact point, without the last spacing before
  /// the
  /// wall, where outlines are rounded. Numbers: x, y, dx, dy, reach.
  kContact,
  /// Angle of repose of the largest body: `left_angle`, `right_angle` in degrees. Straight lines
  /// are
  /// fitted to its upper surface left and right of the peak, between 20 and 80 % of its height.
  /// Numbers: none.
  kRepose,
  /// Packing of particles that are discs in a box: `fraction`, the `discs` area in the box (the sum
  /// of the discs, so overlaps count twice) divided by the `area` of the inside of the outline in
  /// the box. Requires Discs. Numbers: min_x, min_y, max_x, max_y.
  kPacking,
};

/// A measurement of an outline. Lengths are in world units, heights and upwards along y (in a
/// section, along the second axis of the plane).
struct Gauge {
  std::string name;  ///< Letters, digits and "_", at most 40.
  GaugeKind kind = GaugeKind::kHeight;
  std::vector<double> numbers;  ///< As the kind requires.
};

/// The particles of the frame as discs. Empty: not known.
struct Discs {
  std::span<const double> centres;  ///< x0, y0, x1, y1, ...
  std::span<const float> areas;     ///< Of each disc, 0 or more; as Frame::volumes.
};

/// Description of a kind: its name, the names of its numbers, and the names of its values.
struct GaugeTraits {
  GaugeKind kind;
  std::string_view name;
  std::vector<std::string_view> numbers, values;
};

/// All kinds, in the order of the enumerators.
std::span<const GaugeTraits> AllGauges();
const GaugeTraits& TraitsOf(GaugeKind kind);

/// Errors: INVALID_ARGUMENT with a Violation for a bad name, a wrong count of numbers, a number
/// that is not finite or out of range.
absl::Status Check(const Gauge& gauge);

/// Parses "NAME=KIND:NUMBER,NUMBER,...": "level=height:0.5", "slope=repose".
/// Errors: as Check; INVALID_ARGUMENT for any other text.
absl::StatusOr<Gauge> ParseGauge(std::string_view text);

/// The values of a gauge, in the order of its traits; NaN where the outline has no such point, or
/// where a gauge requires discs and `discs` has not one area for each centre.
/// Intersections are computed for each segment, so the only error is that of the outline itself.
/// Requires: Check(gauge).ok(). Cost: linear in the points, times log n for `height` and `wetted`;
/// 200 times for `repose`; also linear in the discs for `packing`.
std::vector<double> Measure(const Gauge& gauge, const Result& result, const Discs& discs = {});

/// The heights y at which the outline crosses the vertical line at `x`, ascending. The inside is
/// between heights 0 and 1, 2 and 3, and so on.
std::vector<double> HeightsAt(const Rings& rings, double x);

}  // namespace partiemc
