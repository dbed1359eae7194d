#include "phases/junction_angles.h"

#include <algorithm>

#include "base/point.h"
#include "walls/point_math.h"

namespace partiemc {
namespace {

// The part of a side that determines its direction, in spacings. Nearer points lie on a parabola
// from the junction (MoveJunctions).
constexpr double kNearest = 1.5, kFarthest = 8;
// A parabola with fewer points would follow their noise.
constexpr int kFewestPoints = 4;

/// Sums of the least squares fit of x(s) = a + t s + c s^2, for both coordinates.
struct ParabolaFit {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0;
  Point x0, x1, x2;  // Sums of x, x s and x s^2.

  void Add(const Point& x, double s) {
    const double square = s * s;
    s0 += 1;
    s1 += s;
    s2 += square;
    s3 += square * s;
    s4 += square * square;
    x0 = Plus(x0, x);
    x1 = Plus(x1, Times(x, s));
    x2 = Plus(x2, Times(x, square));
  }
  /// t, up to a positive factor: by Cramer's rule, without the determinant.
  Point Direction() const {
    const double of_x0 = s2 * s3 - s1 * s4, of_x1 = s0 * s4 - s2 * s2, of_x2 = s1 * s2 - s0 * s3;
    return Plus(Plus(Times(x0, of_x0), Times(x1, of_x1)), Times(x2, of_x2));
  }
};

/// The direction in which a side leaves the junction at point `k`, if it is long enough; `step` is
/// 1 for the side after it, -1 for the side before it. Inside of the body, the junction is one of
/// the points. On the body's outline it is not, since there it stays on the rounded outline.
std::optional<Point> DirectionFrom(const PhaseRing& ring, std::size_t k, int step, bool is_inside,
                                   double h) {
  const std::size_t count = ring.points.size();
  const Point junction = PointAt(ring.world, ring.points[k]);
  ParabolaFit fit;
  Point last;  // Relative to the junction.
  double s = 0;
  for (std::size_t n = 1; n < count; ++n) {
    const std::size_t at = (k + (step > 0 ? n : count - n)) % count;
    const Point x = Minus(PointAt(ring.world, ring.points[at]), junction);
    s += Length(Minus(x, last)) / h;
    last = x;
    if (s > kFarthest || ring.is_junction[ring.points[at]] != 0) break;
    if (s >= kNearest) fit.Add(x, s);
  }
  if (fit.s0 < kFewestPoints) return std::nullopt;
  if (is_inside) fit.Add({}, 0);
  return fit.Direction();
}

}  // namespace

std::optional<float> JunctionAngle(const PhaseRing& ring, std::size_t k, bool is_inside,
                                   double spacing) {
  const auto after = DirectionFrom(ring, k, 1, is_inside, spacing);
  const auto before = DirectionFrom(ring, k, -1, is_inside, spacing);
  if (!after || !before) return std::nullopt;
  const double angle = AngleBetween(*after, *before);
  constexpr double kTurn = 6.283185307179586;  // 2 pi.
  // The inside is on the left of the ring.
  const double inside = Cross(*after, *before) < 0 ? kTurn - angle : angle;
  return std::min(static_cast<float>(inside), static_cast<float>(kTurn));
}

}  // namespace partiemc
