#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "base/bits.h"
#include "base/expansion.h"

namespace partiemc {
namespace {

// The sign of value - (root + part)^3, computed exactly. Requires: no product underflows.
int SignOfRest(double value, double root, double part) {
  Expansion<33> rest;
  rest.Add(value);
  rest.AddProduct(-root, root, root);
  for (int k = 0; k < 3; ++k) {
    rest.AddProduct(-root, root, part);
    rest.AddProduct(-root, part, part);
  }
  rest.AddProduct(-part, part, part);
  return rest.Sign();
}

TEST(CubeRoot, IsRoundedCorrectly) {
  std::mt19937_64 random(7);
  for (int k = 0; k < 100000; ++k) {
    // From 2^-200 to 2^200.
    const std::uint64_t bits = (random() >> 12) | (823 + random() % 400) << 52;
    const auto value = std::bit_cast<double>(bits);
    const double root = CubeRoot(value);
    const double above = std::nextafter(root, std::numeric_limits<double>::infinity()) - root;
    const double below = root - std::nextafter(root, 0.0);
    EXPECT_LT(SignOfRest(value, root, above / 2), 0) << value;
    EXPECT_GT(SignOfRest(value, root, -below / 2), 0) << value;
  }
}

TEST(CubeRoot, OfCubesIsExact) {
  for (int k = -100000; k <= 100000; ++k) {
    const double root = k / 8.0;
    EXPECT_EQ(CubeRoot(root * root * root), root);
  }
}

TEST(CubeRoot, CoversAllDoubles) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(CubeRoot(kInfinity), kInfinity);
  EXPECT_EQ(CubeRoot(-kInfinity), -kInfinity);
  EXPECT_TRUE(std::isnan(CubeRoot(NAN)));
  EXPECT_TRUE(std::signbit(CubeRoot(-0.0)));
  EXPECT_EQ(CubeRoot(0x1p-1074), 0x1p-358);
  EXPECT_EQ(CubeRoot(-0x1p1023), -0x1p341);
  EXPECT_NEAR(CubeRoot(std::numeric_limits<double>::max()) * 0x1p-341, std::cbrt(2.0), 1e-15);
}

}  // namespace
}  // namespace partiemc
