// Closed polylines: the boundary of a region, true or reconstructed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::evaluation {

struct Point {
  double x = 0, y = 0;

  friend Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y}; }
  friend Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
  friend Point operator*(double s, Point a) { return {s * a.x, s * a.y}; }
  friend bool operator==(const Point&, const Point&) = default;
};

inline double Dot(Point a, Point b) { return a.x * b.x + a.y * b.y; }
inline double Cross(Point a, Point b) { return a.x * b.y - a.y * b.x; }
double Length(Point a);

/// Closed polylines, the region on their left: outer loops counter-clockwise, holes clockwise. The
/// end of a loop is not stored twice; each loop has at least three points.
struct Outline {
  std::vector<Point> points;
  std::vector<std::uint32_t> offsets = {0};  ///< Loop k has points [offsets[k], offsets[k + 1]).

  std::size_t LoopCount() const { return offsets.size() - 1; }
  bool Empty() const { return points.empty(); }
  std::span<const Point> Loop(std::size_t loop) const {
    return std::span(points).subspan(offsets[loop], offsets[loop + 1] - offsets[loop]);
  }
  void AddLoop(std::span<const Point> loop);

  friend bool operator==(const Outline&, const Outline&) = default;
};

/// The rings of a result.
Outline OutlineOf(const Rings& rings);

/// Signed area that a loop encloses: positive counter-clockwise. By the shoelace formula relative
/// to the loop's first point, so that an outline far from the origin loses no digits.
double SignedArea(std::span<const Point> loop);

/// Sum over all loops: the area of the region.
double SignedArea(const Outline& outline);

double Perimeter(const Outline& outline);

struct LoopCounts {
  std::size_t outer = 0, holes = 0;
};

/// Loops by the sign of their area: components and holes of the region.
LoopCounts CountLoops(const Outline& outline);

/// The same outline with points inserted so that no segment is longer than `step`.
Outline Densify(const Outline& outline, double step);

/// Rotates, scales and moves: p -> scale * R p + shift.
struct Similarity {
  double cosine = 1, sine = 0;
  double scale = 1;
  Point shift;

  Point operator()(Point p) const {
    return {scale * (cosine * p.x - sine * p.y) + shift.x,
            scale * (sine * p.x + cosine * p.y) + shift.y};
  }
  /// The point that this similarity takes to `p`. Requires: scale != 0.
  Point Inverse(Point p) const;
};

}  // namespace partiemc::evaluation
