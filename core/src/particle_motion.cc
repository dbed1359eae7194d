// Ridge regression (Hoerl, Kennard, "Ridge Regression: Biased Estimation for Nonorthogonal
// Problems", 1970) of an affine map, of which the turn is found first: the polar part of the
// moments, in closed form in the plane (Horn, "Closed-form solution of absolute orientation using
// unit quaternions", 1987).
#include "particle_motion.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace partiemc {
namespace {

// What the ridge expects of strains from frame to frame; what is beyond it is likelier noise. The
// ridge itself is a share of the squared reach, in these bounds: with less of it, rows of movers
// tilt freely, with more, movers on one side of the outline drag it behind every strain.
constexpr double kExpectedStrain = 0.07;
constexpr double kLeastRidge = 0.003;
constexpr double kLargestRidge = 0.04;

// Of a crowd, the movers heard of in a square as wide as the reach, where about nine are usual. All
// of them would tell no more, and the frame after a state that somebody made up, with crowds of
// points among crowds of movers, would cost the product of both.
constexpr std::uint32_t kMostInSquare = 128;

// Numbers of a plane's affine map, which a fit takes from the noise of so few movers.
constexpr double kFitted = 3;
constexpr double kLeastRest = 0.1;

// Weighted moments of arms (from the asked point to the mover) and ways.
struct Moments {
  double weight = 0, squared_weight = 0;
  Point arm, way;
  double xx = 0, xy = 0, yy = 0;  // Of the arm with itself.
  Point by_x, by_y;               // Of arm.x and of arm.y with the way.
  double ways = 0;                // Of the way with itself.

  void Add(Point a, Point w, double weight_of) {
    weight += weight_of;
    squared_weight += weight_of * weight_of;
    const Point wa{weight_of * a.x, weight_of * a.y};
    arm = {arm.x + wa.x, arm.y + wa.y};
    way = {way.x + weight_of * w.x, way.y + weight_of * w.y};
    xx += wa.x * a.x;
    xy += wa.x * a.y;
    yy += wa.y * a.y;
    by_x = {by_x.x + wa.x * w.x, by_x.y + wa.x * w.y};
    by_y = {by_y.x + wa.y * w.x, by_y.y + wa.y * w.y};
    ways += weight_of * (w.x * w.x + w.y * w.y);
  }

  // Means, and moments about them.
  void Centre() {
    const double share = 1 / weight;
    arm = {share * arm.x, share * arm.y};
    way = {share * way.x, share * way.y};
    xx = share * xx - arm.x * arm.x;
    xy = share * xy - arm.x * arm.y;
    yy = share * yy - arm.y * arm.y;
    by_x = {share * by_x.x - arm.x * way.x, share * by_x.y - arm.x * way.y};
    by_y = {share * by_y.x - arm.y * way.x, share * by_y.y - arm.y * way.y};
    ways = share * ways - way.x * way.x - way.y * way.y;
  }
};

// How a displacement changes along x and along y.
struct Slopes {
  Point along_x, along_y;
};

// Of centred moments.
Slopes FitSlopes(const Moments& m, double ridge) {
  const double xx = m.xx + ridge, yy = m.yy + ridge;
  const double inverse = 1 / (xx * yy - m.xy * m.xy);
  return {
      {inverse * (yy * m.by_x.x - m.xy * m.by_y.x), inverse * (yy * m.by_x.y - m.xy * m.by_y.y)},
      {inverse * (xx * m.by_y.x - m.xy * m.by_x.x), inverse * (xx * m.by_y.y - m.xy * m.by_x.y)}};
}

// Variance of the ways, along one axis, about an affine map: their noise.
double NoiseOf(const Moments& m, double ridge) {
  const auto [u, v] = FitSlopes(m, ridge);
  const double explained = 2 * (u.x * m.by_x.x + u.y * m.by_x.y + v.x * m.by_y.x + v.y * m.by_y.y) -
                           m.xx * (u.x * u.x + u.y * u.y) - m.yy * (v.x * v.x + v.y * v.y) -
                           2 * m.xy * (u.x * v.x + u.y * v.y);
  const double rest = 1 - kFitted * m.squared_weight / (m.weight * m.weight);
  return std::max(0.0, m.ways - explained) / 2 / std::max(rest, kLeastRest);
}

}  // namespace

void ParticleMotion::Build(std::span<const Mover> movers, double reach) {
  reach_ = reach;
  movers_.Build(movers, reach);
}

std::optional<Point> ParticleMotion::Carry(Point p) const {
  const double reach_square = reach_ * reach_;
  Moments m;
  Point common;  // Way of the first mover: what all do loses no digits of what each does.
  const auto hear_of = [&](const Mover& mover) {
    const auto& [at, way] = mover;
    const Point arm{at.x - p.x, at.y - p.y};
    const double rest = 1 - (arm.x * arm.x + arm.y * arm.y) / reach_square;
    if (!(rest > 0)) return;
    if (m.weight == 0) common = way;
    m.Add(arm, {way.x - common.x, way.y - common.y}, rest * rest * rest);
  };
  movers_.ForEachNear(p, hear_of, kMostInSquare);
  if (!(m.weight > 0)) return std::nullopt;
  m.Centre();

  const double noise = NoiseOf(m, kLeastRidge * reach_square);
  const double few = m.squared_weight / (m.weight * m.weight);
  const double ridge = std::clamp(noise * few / (kExpectedStrain * kExpectedStrain),
                                  kLeastRidge * reach_square, kLargestRidge * reach_square);
  // The turn that takes arms nearest to where their movers arrive.
  const double dot = m.xx + m.yy + m.by_x.x + m.by_y.y + ridge;
  const double cross = m.by_x.y - m.by_y.x;
  const double length = std::sqrt(dot * dot + cross * cross);
  const double c = length > 0 ? dot / length : 1;
  const double s = length > 0 ? cross / length : 0;
  // What it leaves over.
  Moments strained = m;
  strained.by_x = {m.by_x.x - ((c - 1) * m.xx - s * m.xy), m.by_x.y - (s * m.xx + (c - 1) * m.xy)};
  strained.by_y = {m.by_y.x - ((c - 1) * m.xy - s * m.yy), m.by_y.y - (s * m.xy + (c - 1) * m.yy)};
  const auto [u, v] = FitSlopes(strained, ridge);
  const Point back{-m.arm.x, -m.arm.y};  // From the middle of the movers to the point.
  return Point{p.x + common.x + m.way.x + (c - 1 + u.x) * back.x + (v.x - s) * back.y,
               p.y + common.y + m.way.y + (s + u.y) * back.x + (c - 1 + v.y) * back.y};
}

}  // namespace partiemc
