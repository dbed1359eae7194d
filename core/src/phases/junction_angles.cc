#include "phases/junction_angles.h"

#include <numbers>

#include "base/point.h"
#include "walls/point_math.h"

namespace partiemc {
namespace {

// The part of a side that determines its direction, in spacings. Nearer points lie on a chord
// (MoveJunctions).
constexpr double kNearest = 1.5, kFarthest = 6;
// A parabola with fewer points would follow their noise.
constexpr int kFewestPoints = 4;

/// Sums of the least squares fit of x(s) = t s + c s^2, for both coordinates.
struct ParabolaFit {
  double s2 = 0, s3 = 0, s4 = 0;
  Point x1, x2;  // Sums of x s and x s^2.
  int count = 0;

  void Add(const Point& x, double s) {
    const double square = s * s;
    s2 += square;
    s3 += square * s;
    s4 += square * square;
    x1 = Plus(x1, Times(x, s));
    x2 = Plus(x2, Times(x, square));
    ++count;
  }
  /// t, up to a positive factor.
  Point Direction() const { return Minus(Times(x1, s4), Times(x2, s3)); }
};

/// The direction in which a side leaves the junction at point `k`; `step` is 1 for the side after
/// it, -1 for the side before it.
Point DirectionFrom(const PhaseRing& ring, std::size_t k, int step, double h) {
  const std::size_t count = ring.points.size();
  const Point junction = PointAt(ring.world, ring.points[k]);
  ParabolaFit fit;
  Point chord, last;  // Relative to the junction.
  double s = 0;
  for (std::size_t n = 1; n < count; ++n) {
    const std::size_t at = (k + (step > 0 ? n : count - n)) % count;
    const Point x = Minus(PointAt(ring.world, ring.points[at]), junction);
    s += Length(Minus(x, last)) / h;
    last = x;
    if (s > kFarthest) break;
    chord = x;
    if (s >= kNearest) fit.Add(x, s);
    if (ring.is_junction[ring.points[at]] != 0) break;
  }
  if (chord == Point{}) return last;  // The first segment is long.
  return fit.count < kFewestPoints ? chord : fit.Direction();
}

}  // namespace

float JunctionAngle(const PhaseRing& ring, std::size_t k, double spacing) {
  const Point after = DirectionFrom(ring, k, 1, spacing);
  const Point before = DirectionFrom(ring, k, -1, spacing);
  const double angle = AngleBetween(after, before);
  // The inside is on the left of the ring.
  return static_cast<float>(Cross(after, before) < 0 ? 2 * std::numbers::pi - angle : angle);
}

}  // namespace partiemc
