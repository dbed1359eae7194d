#include "gauges/disc_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace partiemc {
namespace {

// The signed area between the origin and an arc from the direction a to the direction b.
double Sector(const Point& a, const Point& b, double radius) {
  return radius * radius * std::atan2(Cross(a, b), a.x * b.x + a.y * b.y) / 2;
}

// The signed area of the part of the triangle (origin, a, b) in a disc around the origin.
double TriangleInDisc(const Point& a, const Point& b, double radius) {
  const Point d{b.x - a.x, b.y - a.y};
  const double length_squared = d.x * d.x + d.y * d.y;
  if (length_squared == 0) return 0;
  // Solves |a + t d| = radius: t is middle +- half.
  const double middle = -(a.x * d.x + a.y * d.y) / length_squared;
  const double distance = Cross(a, d) / std::sqrt(length_squared);
  const double half_squared = (radius * radius - distance * distance) / length_squared;
  if (half_squared <= 0) return Sector(a, b, radius);
  const double half = std::sqrt(half_squared);
  const double from = std::clamp(middle - half, 0.0, 1.0);
  const double to = std::clamp(middle + half, 0.0, 1.0);
  if (!(from < to)) return Sector(a, b, radius);
  const Point p{a.x + from * d.x, a.y + from * d.y}, q{a.x + to * d.x, a.y + to * d.y};
  double area = Cross(p, q) / 2;
  if (from > 0) area += Sector(a, p, radius);
  if (to < 1) area += Sector(q, b, radius);
  return area;
}

}  // namespace

double DiscAreaInBox(const Point& centre, double radius, const Point& min, const Point& max) {
  const Point low{min.x - centre.x, min.y - centre.y}, high{max.x - centre.x, max.y - centre.y};
  const double inner = std::min({-low.x, -low.y, high.x, high.y});
  if (inner >= radius) return std::numbers::pi * radius * radius;
  // The distance of the box from the centre of the disc, along each axis.
  const double x = std::max({low.x, -high.x, 0.0}), y = std::max({low.y, -high.y, 0.0});
  if (std::sqrt(x * x + y * y) >= radius) return 0;
  const std::array<Point, 4> corners = {low, {high.x, low.y}, high, {low.x, high.y}};
  double area = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    area += TriangleInDisc(corners[k], corners[(k + 1) % corners.size()], radius);
  }
  return std::max(area, 0.0);
}

}  // namespace partiemc
