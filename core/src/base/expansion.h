// Exact sums and products of doubles (J. R. Shewchuk, Discrete & Computational Geometry 18, 1997).
// Requires round-to-nearest, no overflow or underflow, and no contraction of a * b + c.
#pragma once

#include <array>
#include <cstddef>

namespace partiemc {

/// The rounded result of an operation and its rounding error.
struct Rounded {
  double value, error;
};

/// Knuth's sum: a + b = value + error exactly, whichever of a and b is larger.
inline Rounded TwoSum(double a, double b) {
  const double value = a + b;
  const double b_part = value - a;
  const double a_part = value - b_part;
  return {value, (a - a_part) + (b - b_part)};
}

/// Veltkamp's split: a = high + low. Halves have at most 26 bits, so products of halves are exact.
struct Halves {
  double high, low;
};

inline Halves Split(double a) {
  constexpr double kSplitter = 0x1p27 + 1.0;
  const double scaled = kSplitter * a;
  const double high = scaled - (scaled - a);
  return {high, a - high};
}

/// Dekker's product: a * b = value + error exactly.
inline Rounded TwoProduct(double a, double b) {
  const double value = a * b;
  const Halves p = Split(a);
  const Halves q = Split(b);
  const double error =
      ((p.high * q.high - value) + p.high * q.low + p.low * q.high) + p.low * q.low;
  return {value, error};
}

inline int SignOf(double value) { return (value > 0) - (value < 0); }

/// An exact sum of up to `kTerms` doubles: non-overlapping components in order of magnitude
/// (Shewchuk, section 2.2). The sign of the sum is the sign of its last component.
template <std::size_t kTerms>
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

  /// Adds a * b: two terms.
  void AddProduct(double a, double b) {
    const Rounded product = TwoProduct(a, b);
    Add(product.error);
    Add(product.value);
  }

  /// Adds a * b * c: four terms.
  void AddProduct(double a, double b, double c) {
    const Rounded product = TwoProduct(a, b);
    AddProduct(product.error, c);
    AddProduct(product.value, c);
  }

  int Sign() const { return size_ == 0 ? 0 : SignOf(components_[size_ - 1]); }

 private:
  std::array<double, kTerms> components_;
  std::size_t size_ = 0;
};

}  // namespace partiemc
