#include "phases/arc_curve.h"

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

// A bend is fitted only to at least this number of points.
constexpr int kFewestBent = 5;
// The direction of the larger eigenvalue of a covariance.
Point MainDirection(double xx, double xy, double yy) {
  const double half = (xx - yy) / 2;
  const double root = std::sqrt(half * half + xy * xy);
  return half >= 0 ? Point{half + root, xy} : Point{xy, root - half};
}

}  // namespace

Line ArcCurve::TangentNear(const Point& at) const {
  const double t = Dot(along, at), n = Cross(along, at);
  const double excess = n - offset - slope * t - bend * (t * t + n * n);
  // The gradient is small only near the middle of a circle.
  double by_t = -slope - 2 * bend * t, by_n = 1 - 2 * bend * n;
  double square = by_t * by_t + by_n * by_n;
  if (square < .25) {
    by_t = 0;
    by_n = square = 1;
  }
  const double length = std::sqrt(square);
  const double to_t = t - excess * by_t / square, to_n = n - excess * by_n / square;
  by_t /= length;
  by_n /= length;
  return {{to_t * along.x - to_n * along.y, to_t * along.y + to_n * along.x},
          {by_n * along.x + by_t * along.y, by_n * along.y - by_t * along.x}};
}

Point ArcCurve::DirectionAt(const Point& at) const {
  const Point direction = TangentNear(at).along;
  return Dot(direction, along) < 0 ? Times(direction, -1) : direction;
}

double ArcCurve::MisfitOf(const Point& at) const {
  const double t = Dot(along, at), n = Cross(along, at);
  return n - offset - slope * t - bend * (t * t + n * n);
}

void ArcCurveFit::Sums::Add(const Point& at) {
  const double square = Dot(at, at);
  count += 1;
  x += at.x;
  y += at.y;
  q += square;
  xx += at.x * at.x;
  xy += at.x * at.y;
  yy += at.y * at.y;
  xq += at.x * square;
  yq += at.y * square;
  qq += square * square;
}

void ArcCurveFit::Add(const Point& at, double distance) {
  if (distance < kCurveNearest) return;
  if (distance <= kCurveFarthest) near_.Add(at);
  if (distance <= kCurvatureFarthest) wide_.Add(at);
}

void ArcCurveFit::AddEnd(const Point& at) {
  near_.Add(at);
  wide_.Add(at);
}

ArcCurveFit::Moments ArcCurveFit::MomentsOf(const Sums& s, const Point& along) {
  const double a = along.x, b = along.y;
  const double x = s.x / s.count, y = s.y / s.count, q = s.q / s.count;
  const double xx = s.xx - s.x * x, xy = s.xy - s.x * y, yy = s.yy - s.y * y;
  const double xq = s.xq - s.x * q, yq = s.yq - s.y * q;
  return {.t = a * x + b * y,
          .n = a * y - b * x,
          .q = q,
          .tt = a * a * xx + 2 * a * b * xy + b * b * yy,
          .tn = a * b * (yy - xx) + (a * a - b * b) * xy,
          .nn = a * a * yy - 2 * a * b * xy + b * b * xx,
          .tq = a * xq + b * yq,
          .nq = a * yq - b * xq,
          .qq = s.qq - s.q * q};
}

double ArcCurveFit::BendOf(const Sums& sums, const Point& along, double noise) {
  if (sums.count < kFewestBent) return 0;
  const Moments m = MomentsOf(sums, along);
  if (!(m.tt > 0)) return 0;
  // Without the parts that depend linearly on t.
  const double qq = m.qq - m.tq * m.tq / m.tt, nq = m.nq - m.tn * m.tq / m.tt;
  const double nn = m.nn - m.tn * m.tn / m.tt;
  if (!(qq > 0)) return 0;
  const double bend = nq / qq;
  const double variance = std::max(nn - bend * nq, 0.0) / ((sums.count - 3) * qq);
  const double square = bend * bend;
  return square > noise * variance ? bend * (1 - noise * variance / square) : 0;
}

std::optional<ArcCurve> ArcCurveFit::Fit(double noise) const {
  if (near_.count < 2) return std::nullopt;
  const Moments world = MomentsOf(near_, {1, 0});
  ArcCurve curve{.along = MainDirection(world.tt, world.tn, world.nn)};
  const double length = Length(curve.along);
  if (!(length > 0)) return std::nullopt;
  const bool is_backward = curve.along.x * near_.x + curve.along.y * near_.y < 0;
  curve.along = Times(curve.along, is_backward ? -1 / length : 1 / length);
  curve.bend = BendOf(wide_, curve.along, noise);
  const Moments m = MomentsOf(near_, curve.along);
  if (!(m.tt > 0)) return std::nullopt;
  curve.slope = (m.tn - curve.bend * m.tq) / m.tt;
  curve.offset = m.n - curve.slope * m.t - curve.bend * m.q;
  return curve;
}

}  // namespace partiemc
