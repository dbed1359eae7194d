#include "base/predicates_in_space.h"

#include <cstdint>

#include "base/expansion.h"

namespace partiemc {
namespace {

/// A difference of points, and whether its rounded value is exact.
struct Difference {
  Vec3 value;
  bool is_exact;
};

Difference DifferenceOf(const Vec3& a, const Vec3& b) {
  const Rounded x = TwoSum(a.x, -b.x), y = TwoSum(a.y, -b.y), z = TwoSum(a.z, -b.z);
  return {{x.value, y.value, z.value}, x.error == 0 && y.error == 0 && z.error == 0};
}

/// Adds sign * det(a, b, c): 24 terms.
template <typename Sum>
void AddDeterminant(double sign, const Vec3& a, const Vec3& b, const Vec3& c, Sum& sum) {
  sum.AddProduct(sign * a.x, b.y, c.z);
  sum.AddProduct(-sign * a.x, b.z, c.y);
  sum.AddProduct(sign * a.y, b.z, c.x);
  sum.AddProduct(-sign * a.y, b.x, c.z);
  sum.AddProduct(sign * a.z, b.x, c.y);
  sum.AddProduct(-sign * a.z, b.y, c.x);
}

thread_local std::uint64_t exact_predicates = 0;

}  // namespace

std::uint64_t ExactPredicates() { return exact_predicates; }

int SideOfPlaneExact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  ++exact_predicates;
  const Difference p = DifferenceOf(b, a), q = DifferenceOf(c, a), r = DifferenceOf(d, a);
  if (p.is_exact && q.is_exact && r.is_exact) {
    Expansion<24> determinant;
    AddDeterminant(1, p.value, q.value, r.value, determinant);
    return determinant.Sign();
  }
  // The same determinant, det(b - a, c - a, d - a), expanded in the coordinates.
  Expansion<96> determinant;
  AddDeterminant(1, b, c, d, determinant);
  AddDeterminant(-1, a, c, d, determinant);
  AddDeterminant(1, a, b, d, determinant);
  AddDeterminant(-1, a, b, c, determinant);
  return determinant.Sign();
}

}  // namespace partiemc
