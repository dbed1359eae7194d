#include "client/evaluation/scenes/trigonometry.h"

#include <cmath>

namespace partiemc::evaluation {
namespace {

// pi/2 in two parts, the first with 33 bits, so that its multiples up to 2^20 are exact.
constexpr double kHalfPiHigh = 0x1.921fb544p+0;
constexpr double kHalfPiLow = 0x1.0b4611a626331p-34;

// Taylor series around 0: their next terms are below 1e-17 for |x| <= pi/4.
double SineNearZero(double x) {
  const double s = x * x;
  double sum = 0;
  for (int k = 17; k >= 3; k -= 2) sum = (1 - sum) * s / (k * (k - 1));
  return x * (1 - sum);
}

double CosineNearZero(double x) {
  const double s = x * x;
  double sum = 0;
  for (int k = 18; k >= 2; k -= 2) sum = (1 - sum) * s / (k * (k - 1));
  return 1 - sum;
}

}  // namespace

Direction DirectionOf(double angle) {
  const double quarter = std::floor(angle / (kPi / 2) + 0.5);
  const double rest = (angle - quarter * kHalfPiHigh) - quarter * kHalfPiLow;
  const double c = CosineNearZero(rest);
  const double s = SineNearZero(rest);
  switch (static_cast<long long>(quarter) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

}  // namespace partiemc::evaluation
