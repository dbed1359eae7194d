#include "phases/junction_angles.h"

#include <algorithm>

#include "base/point.h"
#include "phases/arc_curve.h"

namespace partiemc {
namespace {

// A curve with fewer points would follow their noise.
constexpr int kFewestPoints = 4;
// As kPlaceNoise, for directions.
constexpr double kDirectionNoise = 20;

bool LiesOnWall(const PhaseRing& ring, std::uint32_t point) {
  return ring.walls != nullptr && point < ring.walls->kind.size() && IsOnWall(ring.walls, point);
}

/// The direction in which a side of the ring leaves the junction at point `k`; absent if the side
/// is too short. `step`: 1 for the side after the junction, -1 for the side before it. Inside of
/// the body, the junction is one of the fitted points. On the outline of the body it is not,
/// because its place is less certain there.
std::optional<Point> DirectionFrom(const PhaseRing& ring, std::size_t k, int step, bool is_inside,
                                   double h) {
  const std::size_t count = ring.points.size();
  const Point junction = PointAt(ring.world, ring.points[k]);
  ArcCurveFit fit;
  Point last;  // Relative to the junction.
  double s = 0;
  int points = 0;
  for (std::size_t n = 1; n < count; ++n) {
    const std::size_t at = (k + (step > 0 ? n : count - n)) % count;
    const Point x = Minus(PointAt(ring.world, ring.points[at]), junction);
    s += Length(Minus(x, last)) / h;
    last = x;
    if (LiesOnWall(ring, ring.points[at])) {
      if (n == 1 && LiesOnWall(ring, ring.points[k])) return x;
      break;
    }
    if (s > kCurvatureFarthest || ring.is_junction[ring.points[at]] != 0) break;
    fit.Add(x, s);
    points += s >= kCurveNearest;
  }
  if (points < kFewestPoints) return std::nullopt;
  if (is_inside) fit.AddEnd({});
  const auto curve = fit.Fit(kDirectionNoise);
  return curve ? std::optional(curve->DirectionAt({})) : std::nullopt;
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
