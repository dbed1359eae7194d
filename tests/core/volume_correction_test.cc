#include "vertices/volume_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/point.h"
#include "support/random.h"

namespace partiemc {
namespace {

// The same offset, computed point by point.
std::vector<double> OffsetPlainly(const std::vector<double>& points, double offset) {
  const std::size_t count = points.size() / 2;
  const auto normal_after = [&](std::size_t k) {
    const std::size_t next = (k + 1) % count;
    Point normal{points[2 * next + 1] - points[2 * k + 1], points[2 * k] - points[2 * next]};
    const double length = std::sqrt(normal.x * normal.x + normal.y * normal.y);
    if (length > 0) normal = {normal.x / length, normal.y / length};
    return normal;
  };
  std::vector<double> target;
  for (std::size_t k = 0; k < count; ++k) {
    const Point a = normal_after((k + count - 1) % count);
    const Point b = normal_after(k);
    const double divisor = std::max(1 + a.x * b.x + a.y * b.y, 0.5);
    target.push_back(points[2 * k] + offset * (a.x + b.x) / divisor);
    target.push_back(points[2 * k + 1] + offset * (a.y + b.y) / divisor);
  }
  return target;
}

std::vector<double> Offset(const std::vector<double>& points, double offset) {
  std::vector<double> target(points.size());
  OffsetRing(points, {}, offset, target.data());
  return target;
}

TEST(RingOffset, MovesSidesOfASquareOutward) {
  const std::vector<double> square = {0, 0, 4, 0, 4, 4, 0, 4};
  EXPECT_EQ(Offset(square, 0.5), (std::vector<double>{-0.5, -0.5, 4.5, -0.5, 4.5, 4.5, -0.5, 4.5}));
}

TEST(RingOffset, AgreesWithPointwiseOffset) {
  for (std::size_t count = 1; count <= 200; ++count) {
    SCOPED_TRACE(testing::Message() << "points, seed " << count);
    support::Random random(count);
    std::vector<double> points(2 * count);
    for (double& coordinate : points) coordinate = random.Uniform(-3, 3);
    // Coincident points, and needles with limited mitres.
    for (std::size_t k = 2; k < count; ++k) {
      if (!random.Chance(0.2)) continue;
      const std::size_t from = random.Chance(0.5) ? k - 1 : k - 2;
      std::copy_n(&points[2 * from], 2, &points[2 * k]);
    }
    const double offset = random.Uniform(-0.3, 0.3);
    ASSERT_EQ(Offset(points, offset), OffsetPlainly(points, offset));
  }
}

}  // namespace
}  // namespace partiemc
