#include "client/evaluation/metrics/logarithm.h"

#include <cmath>

namespace partiemc::evaluation {
namespace {

constexpr double kLogTwo = 0x1.62e42fefa39efp-1;

}  // namespace

double Logarithm(double x) {
  int exponent = 0;
  double part = std::frexp(x, &exponent);  // Exact: in [1/2, 1).
  if (part < 0x1.6a09e667f3bcdp-1) {       // Below sqrt(1/2): closer to 1 when doubled.
    part *= 2;
    --exponent;
  }
  // ln part = 2 artanh t, |t| < 0.172: the series' next term is below 1e-17.
  const double t = (part - 1) / (part + 1);
  double sum = 0;
  for (int k = 21; k >= 1; k -= 2) sum = sum * t * t + 1.0 / k;
  return exponent * kLogTwo + 2 * t * sum;
}

double Exponential(double x) {
  const double exponent = std::floor(x / kLogTwo + 0.5);
  const double rest = x - exponent * kLogTwo;
  // Taylor series, |rest| < 0.35: the next term is below 1e-18.
  double sum = 1;
  for (int k = 15; k >= 1; --k) sum = 1 + sum * rest / k;
  return std::ldexp(sum, static_cast<int>(exponent));  // Exact.
}

}  // namespace partiemc::evaluation
