// Compares window sums along rings with scalar walks along the ring.
#include "vertices/ring_filters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "crossings/crossings.h"
#include "support/instruction_sets.h"
#include "support/random.h"

namespace partiemc {
namespace {

// A ring of `count` vertices with random steps, normals and bases.
class RandomRing {
 public:
  RandomRing(support::Random& random, int count) {
    std::vector<double> steps;
    for (int k = 0; k < count; ++k) {
      const double angle = 2 * 3.14159265358979323846 * k / count;
      const double turn = angle + random.Uniform(-0.7, 0.7);
      const double radius = count * random.Uniform(0.9, 1.1) / 20;
      points_.push_back({100 + radius * std::cos(angle), -50 + radius * std::sin(angle)});
      normals_.push_back({std::cos(turn), std::sin(turn)});
      bases_.push_back(random.Uniform(-0.1, 0.1));
      // Some vertices fall together.
      if (k > 0 && random.Uniform(0, 1) < 0.1) points_[k] = points_[k - 1];
    }
    for (int k = 0; k < count; ++k) {
      const Point& a = points_[k];
      const Point& b = points_[(k + 1) % count];
      steps_.push_back(std::hypot(b.x - a.x, b.y - a.y));
    }
  }

  int count() const { return static_cast<int>(points_.size()); }
  double Length() const {
    double length = 0;
    for (const double step : steps_) length += step;
    return length;
  }
  const std::vector<Point>& normals() const { return normals_; }

  PeriodicRing Copied(PeriodicRings& rings) const {
    // More than a turn in either direction.
    const int margin = count() + 20;
    rings.sizes() = {{static_cast<std::uint32_t>(count()), static_cast<std::uint32_t>(margin)}};
    rings.Allocate();
    const PeriodicRing ring = rings[0];
    for (int k = 0; k < count(); ++k) {
      ring.x[k] = RingUnits(points_[k].x);
      ring.y[k] = RingUnits(points_[k].y);
      ring.normal_x[k] = static_cast<float>(normals_[k].x);
      ring.normal_y[k] = static_cast<float>(normals_[k].y);
      ring.weight[k] = static_cast<float>(WeightOf(k));
      ring.base[k] = static_cast<float>(bases_[k]);
    }
    // In two ranges, like two tasks.
    const auto repeat = [&](auto* values) {
      ring.Repeat(values, 0, count() / 3);
      ring.Repeat(values, count() / 3, count());
    };
    for (std::int32_t* values : {ring.x, ring.y}) repeat(values);
    for (float* values : {ring.normal_x, ring.normal_y, ring.weight, ring.base}) repeat(values);
    // Wraps around on the way.
    double arc = 500;
    for (int k = -margin; k < count() + margin; ++k) {
      ring.arc[k] = RingUnits(arc);
      arc += steps_[(k + margin * count()) % count()];
    }
    return ring;
  }

  // The three functions of ring_filters.h, computed for one vertex.
  Point MeanNormal(int k, double reach, bool by_angle) const {
    Point sum;
    ForEachNear(k, reach, [&](int j, double w) {
      if (by_angle) w *= std::pow(std::max(0.0, Dot(normals_[k], normals_[j])), 16);
      sum.x += w * normals_[j].x;
      sum.y += w * normals_[j].y;
    });
    const double length = std::sqrt(Dot(sum, sum));
    return {sum.x / length, sum.y / length};
  }

  double Curvature(int k, double reach) const {
    const Point tangent{-normals_[k].y, normals_[k].x};
    double turn = 0, square = 0;
    ForEachNear(k, reach, [&](int j, double w) {
      const double along = Dot(Minus(points_[j], points_[k]), tangent);
      turn += w * along * Dot(Minus(normals_[j], normals_[k]), tangent);
      square += w * along * along;
    });
    return square > 0 ? turn / square : 0;
  }

  double Shift(int k, double reach) const {
    double sum = 0, weight = 0;
    ForEachNear(k, reach, [&](int j, double w) {
      w *= std::pow(std::max(0.0, Dot(normals_[k], normals_[j])), 16);
      const Point chord = Minus(points_[j], points_[k]);
      sum += w * ((Dot(normals_[k], chord) + Dot(normals_[j], chord)) / 2 + bases_[j]);
      weight += w;
    });
    return weight > 0 ? sum / weight : bases_[k];
  }

 private:
  static double Dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }
  static Point Minus(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
  double WeightOf(int k) const { return (steps_[(k + count() - 1) % count()] + steps_[k]) / 2; }

  template <typename Visit>
  void ForEachNear(int k, double reach, Visit visit) const {
    const double length = Length();
    double after = 0;
    for (int n = 0; n < count(); ++n) {
      const int j = (k + n) % count();
      const double distance = std::min(after, length - after);
      const double t = 1 - distance * distance / (reach * reach);
      if (distance < reach) visit(j, WeightOf(j) * t * t);
      after += steps_[j];
    }
  }

  std::vector<Point> points_, normals_;
  std::vector<double> bases_, steps_;
};

TEST(RingFilters, UseSameLengthsOnAnyInstructionSet) {
  for (const int count : {24, 31, 100}) {
    support::Random random(static_cast<std::uint64_t>(count));
    const RandomRing source(random, count);
    support::ForEachInstructionSet([&] {
      PeriodicRings rings;
      const PeriodicRing ring = source.Copied(rings);
      MeasureArc(ring, {});
      for (std::ptrdiff_t k = 0; k + 1 < ring.count + ring.margin; ++k) {
        const auto step = [&](std::ptrdiff_t from) {
          return LengthInUnits(UnitsBetween(ring.x[from], ring.x[from + 1]),
                               UnitsBetween(ring.y[from], ring.y[from + 1]));
        };
        ASSERT_EQ(UnitsBetween(ring.arc[k], ring.arc[k + 1]), step(k)) << "vertex " << k;
        if (k >= ring.margin) continue;
        ASSERT_EQ(UnitsBetween(ring.arc[-k - 1], ring.arc[-k]), step(-k - 1)) << "vertex " << k;
        const double both = (step(k - 1) + step(k)) / kRingUnitsPerCell;
        EXPECT_FLOAT_EQ(ring.weight[k], static_cast<float>(both / 2));
        EXPECT_EQ(ring.weight[k - ring.margin],
                  ring.weight[(k - ring.margin + 3 * ring.count) % ring.count]);
      }
    });
  }
}

TEST(RingFilters, AgreeWithScalarWalk) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    support::Random random(seed);
    const RandomRing expected(random, 16 + static_cast<int>(seed) * 2);
    const double reach = expected.Length() * random.Uniform(0.02, 0.5);
    PeriodicRings rings;
    const PeriodicRing ring = expected.Copied(rings);
    MeanCurvature(ring, 0, ring.count, reach);
    for (int k = 0; k < ring.count; ++k) {
      const double curvature = expected.Curvature(k, reach);
      EXPECT_NEAR(ring.shift[k], curvature, 2e-5 * (1 + std::abs(curvature))) << "seed " << seed;
    }
    MeanShift(ring, 0, ring.count, reach);
    for (int k = 0; k < ring.count; ++k) {
      EXPECT_NEAR(ring.shift[k], expected.Shift(k, reach), 1e-6) << "seed " << seed;
    }
    for (const bool by_angle : {false, true}) {
      MeanNormals(ring, 0, ring.count, reach, by_angle);
      for (int k = 0; k < ring.count; ++k) {
        const Point normal = expected.MeanNormal(k, reach, by_angle);
        EXPECT_NEAR(ring.next_x[k], normal.x, 1e-6) << "seed " << seed;
        EXPECT_NEAR(ring.next_y[k], normal.y, 1e-6) << "seed " << seed;
      }
    }
  }
}

TEST(RingFilters, KeepOwnNormalIfMeanVanishes) {
  support::Random random(3);
  const RandomRing source(random, 40);
  PeriodicRings rings;
  const PeriodicRing ring = source.Copied(rings);
  std::fill(ring.weight - ring.margin, ring.weight + ring.count + ring.margin, 0.0f);
  MeanNormals(ring, 0, ring.count, source.Length() / 4, true);
  for (int k = 0; k < ring.count; ++k) {
    EXPECT_EQ(ring.next_x[k], static_cast<float>(source.normals()[k].x));
    EXPECT_EQ(ring.next_y[k], static_cast<float>(source.normals()[k].y));
  }
}

// A polygon whose windows hold many more vertices in one place than at the ends of the ring.
TEST(RingFilters, ReadNothingBeyondMargins) {
  constexpr int kSides = 60, kCrowd = 80;
  constexpr double kReach = 10.5;
  for (const int crowded : {15, kSides - 14}) {
    std::vector<Point> points;
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * 3.14159265358979323846 * k / kSides;
      points.insert(points.end(), k == crowded ? kCrowd : 1,
                    {kSides / 6.0 * std::cos(angle), kSides / 6.0 * std::sin(angle)});
    }
    const auto count = static_cast<std::ptrdiff_t>(points.size());
    // Elements beyond the margins would be near and would change every sum.
    const auto results_with = [&](std::uint32_t more) {
      PeriodicRingSize size = SizeForWindows(points, {}, kReach);
      size.margin += static_cast<std::uint32_t>(kWindowPadding) + more;
      const std::ptrdiff_t room = 3 * count;
      std::vector<std::int32_t> units(3 * room, 0);
      std::vector<float> floats(7 * room, std::numeric_limits<float>::quiet_NaN());
      const PeriodicRing ring = PeriodicRing::In(
          size, [&](int array) { return units.data() + array * room + count; },
          [&](int array) { return floats.data() + array * room + count; });
      for (std::ptrdiff_t k = 0; k < count; ++k) {
        ring.x[k] = RingUnits(points[k].x);
        ring.y[k] = RingUnits(points[k].y);
        ring.normal_x[k] = static_cast<float>(points[k].x * 6 / kSides);
        ring.normal_y[k] = static_cast<float>(points[k].y * 6 / kSides);
        ring.base[k] = 0.01f * static_cast<float>(k % 7);
      }
      for (std::int32_t* values : {ring.x, ring.y}) ring.Repeat(values, 0, count);
      for (float* values : {ring.normal_x, ring.normal_y, ring.base}) ring.Repeat(values, 0, count);
      MeasureArc(ring, {});
      std::vector<float> results;
      const auto keep = [&](const float* of) { results.insert(results.end(), of, of + count); };
      for (const bool by_angle : {false, true}) {
        MeanNormals(ring, 0, count, kReach, by_angle);
        keep(ring.next_x);
        keep(ring.next_y);
      }
      MeanCurvature(ring, 0, count, kReach);
      keep(ring.shift);
      MeanShift(ring, 0, count, kReach);
      keep(ring.shift);
      return results;
    };
    support::ForEachInstructionSet([&] { EXPECT_EQ(results_with(0), results_with(80)); });
  }
}

TEST(RingFilters, SameBitsForAnyInstructionSetAndStretch) {
  support::Random random(5);
  const RandomRing source(random, 103);
  const double reach = source.Length() / 7;
  std::vector<std::vector<float>> results;
  support::ForEachInstructionSet([&] {
    for (const int stretch : {1, 5, 16, 50, 103}) {
      PeriodicRings rings;
      const PeriodicRing ring = source.Copied(rings);
      std::vector<float> result;
      const auto in_stretches = [&](auto step) {
        for (std::ptrdiff_t begin = 0; begin < ring.count; begin += stretch) {
          step(begin, std::min(begin + stretch, ring.count));
        }
      };
      for (const bool by_angle : {false, true}) {
        in_stretches([&](auto begin, auto end) { MeanNormals(ring, begin, end, reach, by_angle); });
        result.insert(result.end(), ring.next_x, ring.next_x + ring.count);
        result.insert(result.end(), ring.next_y, ring.next_y + ring.count);
      }
      in_stretches([&](auto begin, auto end) { MeanCurvature(ring, begin, end, reach); });
      result.insert(result.end(), ring.shift, ring.shift + ring.count);
      in_stretches([&](auto begin, auto end) { MeanShift(ring, begin, end, reach); });
      result.insert(result.end(), ring.shift, ring.shift + ring.count);
      results.push_back(result);
    }
  });
  for (const std::vector<float>& result : results) {
    EXPECT_EQ(std::memcmp(result.data(), results[0].data(), result.size() * sizeof(float)), 0);
  }
}

}  // namespace
}  // namespace partiemc
