#include "base/predicates.h"

#include <algorithm>

#include "base/expansion.h"

namespace partiemc {
namespace {

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
    // The differences are exact, as for points of any lattice, so two exact products are compared.
    // Rounding is monotonic: if the rounded products differ, the exact ones differ in the same
    // way.
    const Rounded left = TwoProduct(acx.value, bcy.value);
    const Rounded right = TwoProduct(acy.value, bcx.value);
    if (left.value != right.value) return left.value > right.value ? 1 : -1;
    return SignOf(left.error - right.error);
  }
  Expansion<12> determinant;  // Six products.
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
  // All four signs are zero if all points lie on one line. The boxes overlap, so the segments do,
  // too.
  return a_side * b_side <= 0;
}

}  // namespace partiemc
