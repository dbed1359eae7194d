#include "base/predicates.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace partiemc {
namespace {

/// The rounded result of an operation and its rounding error.
struct Rounded {
  double value, error;
};

/// Knuth: a + b = value + error exactly, for any order of magnitudes.
Rounded TwoSum(double a, double b) {
  const double value = a + b;
  const double b_part = value - a;
  const double a_part = value - b_part;
  return {value, (a - a_part) + (b - b_part)};
}

/// Veltkamp: a = high + low, each of at most 26 significant bits, so that products of halves are
/// exact.
struct Halves {
  double high, low;
};

Halves Split(double a) {
  constexpr double kSplitter = 0x1p27 + 1.0;
  const double scaled = kSplitter * a;
  const double high = scaled - (scaled - a);
  return {high, a - high};
}

/// Dekker: a * b = value + error exactly.
Rounded TwoProduct(double a, double b) {
  const double value = a * b;
  const Halves p = Split(a);
  const Halves q = Split(b);
  const double error =
      ((p.high * q.high - value) + p.high * q.low + p.low * q.high) + p.low * q.low;
  return {value, error};
}

int Sign(double value) { return (value > 0) - (value < 0); }

/// An exact sum of doubles: non-overlapping components in order of magnitude (Shewchuk, section
/// 2.2). Its sign is the sign of the last component.
class Expansion {
 public:
  /// Grow-Expansion (Shewchuk, Theorem 10).
  void Add(double term) {
    double carry = term;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const Rounded sum = TwoSum(carry, components_[i]);
      carry = sum.value;
      if (sum.error != 0) components_[kept++] = sum.error;
    }
    if (carry != 0) components_[kept++] = carry;
    size_ = kept;
  }

  void AddProduct(double a, double b) {
    const Rounded product = TwoProduct(a, b);
    Add(product.error);
    Add(product.value);
  }

  int Sign() const { return size_ == 0 ? 0 : partiemc::Sign(components_[size_ - 1]); }

 private:
  static constexpr std::size_t kProducts = 6;  // In the determinant of three points.

  std::array<double, 2 * kProducts> components_;
  std::size_t size_ = 0;
};

bool BoxesTouch(const Point& a, const Point& b, const Point& c, const Point& d) {
  return std::max(a.x, b.x) >= std::min(c.x, d.x) && std::max(c.x, d.x) >= std::min(a.x, b.x) &&
         std::max(a.y, b.y) >= std::min(c.y, d.y) && std::max(c.y, d.y) >= std::min(a.y, b.y);
}

}  // namespace

int OrientationExact(const Point& a, const Point& b, const Point& c) {
  const Rounded acx = TwoSum(a.x, -c.x);
  const Rounded acy = TwoSum(a.y, -c.y);
  const Rounded bcx = TwoSum(b.x, -c.x);
  const Rounded bcy = TwoSum(b.y, -c.y);
  if (acx.error == 0 && acy.error == 0 && bcx.error == 0 && bcy.error == 0) {
    // The differences are exact, as on any lattice: compare two exact products. Rounding is
    // monotonic, so the rounded values decide unless they are equal.
    const Rounded left = TwoProduct(acx.value, bcy.value);
    const Rounded right = TwoProduct(acy.value, bcx.value);
    if (left.value != right.value) return left.value > right.value ? 1 : -1;
    return Sign(left.error - right.error);
  }
  Expansion determinant;
  determinant.AddProduct(a.x, b.y);
  determinant.AddProduct(-a.y, b.x);
  determinant.AddProduct(b.x, c.y);
  determinant.AddProduct(-b.y, c.x);
  determinant.AddProduct(c.x, a.y);
  determinant.AddProduct(-c.y, a.x);
  return determinant.Sign();
}

bool SegmentsTouch(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (!BoxesTouch(a, b, c, d)) return false;
  const int c_side = Orientation(a, b, c);
  const int d_side = Orientation(a, b, d);
  if (c_side * d_side > 0) return false;
  const int a_side = Orientation(c, d, a);
  const int b_side = Orientation(c, d, b);
  // All four zero: on one line. Overlapping boxes then mean overlapping segments.
  return a_side * b_side <= 0;
}

}  // namespace partiemc
