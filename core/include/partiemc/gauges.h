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

/// Kinds of measurements. Below, "Numbers" are the arguments (Gauge::numbers); words in backquotes
/// are the measured values, except `reach`.
enum class GaugeKind {
  /// Height of the free surface at a position x: the `highest` and the `lowest` crossing of the
  /// outline with the vertical line at x, and the number of `crossings`. Numbers: x.
  kHeight,
  /// Farthest point of the outline in a direction: its `position` (the distance from the origin
  /// along the direction) and its coordinates `x`, `y`. Numbers: dx, dy.
  kFront,
  /// The `length` of the part of a line segment that lies inside the outline or on its sides.
  /// Numbers: x0, y0, x1, y1 (the ends of the segment).
  kWetted,
  /// `area` and centroid (`x`, `y`) of the part of a box that lies inside the outline. Numbers:
  /// min_x, min_y, max_x, max_y.
  kBox,
  /// Contact angles of the largest body on a straight wall. The wall runs through (x, y) in the
  /// direction (dx, dy), with the body on its left. `start_angle` and `end_angle` are measured
  /// inside the body, in degrees; `start` and `end` are the coordinates of both contact points
  /// along the wall, measured from (x, y). A circle is fitted to the outline within `reach` of each
  /// contact point. The fit leaves out the last spacing before the wall, because outlines are
  /// rounded there. Numbers: x, y, dx, dy, reach.
  kContact,
  /// Angle of repose of the largest body: the slopes of its left and right flank, `left_angle` and
  /// `right_angle`, in degrees. A straight line is fitted to the upper surface on each side of the
  /// peak, between 20 and 80 % of the body's height. Numbers: none.
  kRepose,
  /// Packing of discs in a box: `discs`, the summed area of the discs in the box (overlaps count
  /// twice); `area`, the area inside the outline in the box; `fraction`, `discs` divided by `area`.
  /// Requires Discs. Numbers: min_x, min_y, max_x, max_y.
  kPacking,
};

/// A measurement to make. Lengths are in world units. x and y are the coordinates of results, for a
/// slice along the axes of its plane. Heights are measured along y.
struct Gauge {
  std::string name;  ///< 1 to 40 ASCII letters, digits and "_".
  GaugeKind kind = GaugeKind::kHeight;
  std::vector<double> numbers;  ///< Arguments, in the order of GaugeTraits::numbers.
};

/// The particles of the frame as discs, for GaugeKind::kPacking. Empty if unknown.
struct Discs {
  std::span<const double> centres;  ///< x0, y0, x1, y1, ...
  std::span<const float> areas;     ///< Area of each disc, 0 or more, as in Frame::volumes.
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

/// Parses "NAME=KIND:NUMBER,NUMBER,...", such as "level=height:0.5" or "slope=repose". Errors: as
/// Check; INVALID_ARGUMENT for a text of another form.
absl::StatusOr<Gauge> ParseGauge(std::string_view text);

/// The values of a gauge, in the order of GaugeTraits::values. A height, position, centroid or
/// angle is NaN if the outline does not have it; a length, an area or a number of crossings is then
/// 0. A value that requires discs is NaN if `discs` is empty or has unequal numbers of centres and
/// areas. Only angles and contact points are fitted; all other values are exact for the polygons.
/// Requires: Check(gauge).ok(). Cost: linear in the points of the rings. `height` and `wetted` also
/// sort the crossings, `repose` visits the points 200 times, and `packing` visits every disc.
std::vector<double> Measure(const Gauge& gauge, const Result& result, const Discs& discs = {});

/// The heights y at which the outline crosses the vertical line at `x`, ascending. The inside of
/// the outline lies between the heights with indices 0 and 1, 2 and 3, and so on.
std::vector<double> HeightsAt(const Rings& rings, double x);

}  // namespace partiemc
