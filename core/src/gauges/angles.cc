#include "gauges/angles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>

#include "gauges/fits.h"
#include "partiemc/gauges.h"

namespace partiemc {
namespace {

// An outline is rounded within this distance of a wall, in spacings.
constexpr double kRoundedSpacings = 1;

// The upper surface is sampled at this number of x. A flank lies between these fractions of the
// peak's height.
constexpr int kSurfaceSamples = 200;
constexpr double kFlankFrom = 0.2, kFlankTo = 0.8;

double LengthOf(const Point& p) { return std::sqrt(p.x * p.x + p.y * p.y); }

double Degrees(double radians) { return radians * (180 / std::numbers::pi); }

// The outer ring with the largest area.
std::optional<std::size_t> LargestRing(const Rings& rings) {
  std::optional<std::size_t> largest;
  for (std::size_t k = 0; k < rings.RingCount(); ++k) {
    if (rings.outer_of[k] != kNoRing) continue;
    if (!largest || rings.measures[k].area > rings.measures[*largest].area) largest = k;
  }
  return largest;
}

struct Contact {
  double place = NAN, angle = NAN;
};

// Finds one contact point and its angle, in degrees, by a circle through the points within `reach`
// of the contact. Both are NaN if no circle can be fitted, or if the circle does not meet the wall.
// `points`: coordinates along the wall and heights above the wall. Points lower than `rounded` are
// ignored. `first`: +1 for the start of the contact, -1 for its end.
Contact FindContact(std::span<const Point> points, double reach, double rounded, int first) {
  std::vector<Point> arc;
  for (const Point& p : points) {
    if (p.y >= rounded) arc.push_back(p);
  }
  if (arc.empty()) return {};
  // Finds the outermost point on this side, among the points next to the wall.
  const double lowest = std::ranges::min(arc, {}, &Point::y).y;
  Point side{static_cast<float>(first) * INFINITY, 0};
  for (const Point& p : arc) {
    if (p.y <= lowest + rounded && first * p.x < first * side.x) side = p;
  }
  std::erase_if(arc, [&](const Point& p) {
    return LengthOf({p.x - side.x, p.y - side.y}) > reach;
  });
  const std::optional<Circle> circle = FitCircle(arc);
  if (!circle || std::abs(circle->centre.y) > circle->radius) return {};
  // The wall cuts the circle at +-radius sin(angle). For a drop, the centre is on the body's side
  // of the contact, and cos(angle) = -height of the centre / radius. For a meniscus, the centre is
  // on the other side, and the angle is the supplement.
  const double cosine = -circle->centre.y / circle->radius;
  const double angle = std::acos(cosine);
  const bool is_meniscus = first * (circle->centre.x - side.x) < 0;
  const int toward_contact = is_meniscus ? first : -first;
  return {
      .place = circle->centre.x + toward_contact * circle->radius * std::sqrt(1 - cosine * cosine),
      .angle = Degrees(is_meniscus ? std::numbers::pi - angle : angle)};
}

}  // namespace

std::vector<double> ContactAngles(const Result& result, const WallLine& wall) {
  const std::optional<std::size_t> ring = LargestRing(result.rings);
  if (!ring) return {NAN, NAN, NAN, NAN};
  const double length = LengthOf(wall.direction);
  const Point along{wall.direction.x / length, wall.direction.y / length};
  const std::span<const double> coordinates = result.rings.RingPoints(*ring);
  std::vector<Point> points(coordinates.size() / 2);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Point p = PointAt(coordinates, k);
    const double x = p.x - wall.origin.x, y = p.y - wall.origin.y;
    points[k] = {along.x * x + along.y * y, along.x * y - along.y * x};
  }
  const double rounded = kRoundedSpacings * result.statistics.spacing;
  const Contact start = FindContact(points, wall.reach, rounded, 1);
  const Contact end = FindContact(points, wall.reach, rounded, -1);
  return {start.angle, end.angle, start.place, end.place};
}

std::vector<double> AnglesOfRepose(const Result& result) {
  const std::optional<std::size_t> ring = LargestRing(result.rings);
  if (!ring) return {NAN, NAN};
  const std::span<const double> coordinates = result.rings.RingPoints(*ring);
  Rings body;
  body.points.assign(coordinates.begin(), coordinates.end());
  body.offsets = {0, static_cast<std::uint32_t>(coordinates.size() / 2)};
  body.outer_of = {kNoRing};
  double left = INFINITY, right = -INFINITY, base = INFINITY;
  for (std::size_t k = 0; k < coordinates.size() / 2; ++k) {
    const Point p = PointAt(coordinates, k);
    left = std::min(left, p.x);
    right = std::max(right, p.x);
    base = std::min(base, p.y);
  }
  std::vector<Point> surface;
  for (int k = 0; k < kSurfaceSamples; ++k) {
    const double x = left + (right - left) * (k + 0.5) / kSurfaceSamples;
    const std::vector<double> heights = HeightsAt(body, x);
    if (!heights.empty()) surface.push_back({x, heights.back() - base});
  }
  if (surface.empty()) return {NAN, NAN};
  const Point peak = *std::ranges::max_element(surface, {}, &Point::y);
  std::vector<Point> flanks[2];
  for (const Point& p : surface) {
    if (p.y < kFlankFrom * peak.y || p.y > kFlankTo * peak.y) continue;
    flanks[p.x < peak.x ? 0 : 1].push_back(p);
  }
  const auto angle = [](const std::optional<double>& slope) {
    return slope ? Degrees(std::atan(*slope)) : NAN;
  };
  const double right_angle = angle(FitSlope(flanks[1]));
  return {angle(FitSlope(flanks[0])), -right_angle};
}

}  // namespace partiemc
