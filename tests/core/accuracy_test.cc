// How accurate the field is in random frames: with and without volumes, near the origin and a
// million spacings from it, for spacings from tiny to huge; against sums over all particles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>

#include "support/oracle.h"
#include "support/particles.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::FieldOracle;
using support::Particles;
using support::Random;
using support::Stages;
using support::Vector;

// Relative to the kernel radius for lengths, to max(1, f) for the density and to max(1, length) for
// gradients. About 20 times what is seen: 5e-7 at nodes, which are floats, 5e-6 for gradients, most
// of which is the oracle's own, by differences.
constexpr double kFieldTolerance = 1e-5;
constexpr double kGradientTolerance = 1e-4;

// Spacing, whether a million spacings from the origin, whether particles have volumes.
class AccuracyTest : public testing::TestWithParam<std::tuple<double, bool, bool>> {
 protected:
  Particles RandomFrame(std::uint64_t seed, Random& random, double cell_size) const {
    const auto [spacing, is_far, has_volumes] = GetParam();
    Particles particles = support::RandomScene(seed);
    if (is_far) particles = support::Shifted(particles, 1e6, -0.7e6);
    particles.volumes.clear();
    for (std::size_t k = 0; has_volumes && k < particles.size(); ++k) {
      particles.volumes.push_back(static_cast<float>(random.Uniform(0.3, 1.7)));
    }
    return support::Snapped(support::Scaled(particles, spacing), cell_size);
  }
};

// A point of the plane by the tile that it lies in.
struct Place {
  std::uint32_t tile;
  double x, y;
};

Place PlaceOf(const Stages& stages, Vector at, double cell_size) {
  const double x = at.x / cell_size, y = at.y / cell_size;
  const auto column = static_cast<std::int32_t>(std::floor(x / kTileSize));
  const auto row = static_cast<std::int32_t>(std::floor(y / kTileSize));
  return {stages.bins.tiles.Find({row, column}), x - 32.0 * column, y - 32.0 * row};
}

// Every node is on the right side, and exact where the isoline crosses an edge that it ends.
// Returns whether it is.
bool ExpectNodeAgrees(const Stages& stages, const FieldOracle& oracle, const Place& place,
                      double cell_size) {
  const int i = static_cast<int>(place.x), j = static_cast<int>(place.y);
  const TileCoordinate& tile = stages.bins.tiles[place.tile];
  const Vector node{(32.0 * tile.x + i) * cell_size, (32.0 * tile.y + j) * cell_size};
  const auto value_at = [&](int di, int dj) {
    return stages.level_set.At(stages.bins.tiles, place.tile, i + di, j + dj);
  };
  const double value = value_at(0, 0) * cell_size;
  const double tolerance = kFieldTolerance * oracle.kernel_radius();
  if ((value < 0) != (value_at(1, 0) < 0) || (value < 0) != (value_at(0, 1) < 0)) {
    EXPECT_NEAR(value, oracle.Value(node), tolerance);
    return true;
  }
  if (std::abs(oracle.Value(node)) > tolerance) {
    EXPECT_EQ(value < 0, oracle.Value(node) < 0);
  }
  return false;
}

// Returns whether the gradient was compared, too.
bool ExpectPointAgrees(const FieldSample& sample, const FieldOracle& oracle, Vector at,
                       double cell_size) {
  const double radius = oracle.kernel_radius();
  EXPECT_NEAR(sample.value * cell_size, oracle.Value(at), kFieldTolerance * radius);
  const double density = oracle.Density(at);
  EXPECT_NEAR(sample.density, density, kFieldTolerance * std::max(1.0, density));
  const std::optional<Vector> mean = oracle.Mean(at);
  // Where there are kinks nearby the oracle's differences see both of their sides: between the
  // branches of F, and where x - xbar = 0. At the rim of the support they see outside.
  if (!mean || oracle.KernelSum(at) < 1e-3) return false;
  if (oracle.CreaseMargin(at) < 1e-3 * radius) return false;
  if (std::hypot(mean->x - at.x, mean->y - at.y) < 1e-3 * radius) return false;
  const Vector gradient = oracle.ValueGradient(at);
  const double tolerance = kGradientTolerance * std::max(1.0, std::hypot(gradient.x, gradient.y));
  EXPECT_NEAR(sample.gradient_x, gradient.x, tolerance);
  EXPECT_NEAR(sample.gradient_y, gradient.y, tolerance);
  return true;
}

TEST_P(AccuracyTest, FieldAndGradientAgreeWithSumsOverAllParticles) {
  const double spacing = std::get<0>(GetParam());
  int nodes = 0, gradients = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const ReconstructionParameters parameters{.spacing = spacing,
                                              .kernel_radius = random.Uniform(1.5, 8),
                                              .cell_size = random.Uniform(0.4, 4)};
    const double cell_size = parameters.cell_size * spacing;
    Stages stages;
    stages.Run(RandomFrame(seed, random, cell_size), parameters);
    const FieldOracle oracle(stages.particles, stages.parameters, spacing);
    for (int k = 0; k < 80; ++k) {
      const std::size_t near = random.Below(stages.particles.size());
      const double reach = 1.1 * oracle.kernel_radius();
      const Vector at{stages.particles.x(near) + random.Uniform(-reach, reach),
                      stages.particles.y(near) + random.Uniform(-reach, reach)};
      const Place place = PlaceOf(stages, at, cell_size);
      ASSERT_NE(place.tile, kNoTile);
      nodes += ExpectNodeAgrees(stages, oracle, place, cell_size);
      if (!stages.field.Covers(place.tile, place.x, place.y)) continue;
      const FieldSample sample = stages.field.Sample(place.tile, place.x, place.y);
      gradients += ExpectPointAgrees(sample, oracle, at, cell_size);
    }
  }
  EXPECT_GT(nodes, 100);
  EXPECT_GT(gradients, 500);
}

std::string NameOf(const testing::TestParamInfo<AccuracyTest::ParamType>& tested) {
  const auto [spacing, is_far, has_volumes] = tested.param;
  const int exponent = static_cast<int>(std::round(std::log10(spacing)));
  return std::string(exponent < 0 ? "Minus" : "") + std::to_string(std::abs(exponent)) +
         (is_far ? "Far" : "Near") + (has_volumes ? "WithVolumes" : "");
}

INSTANTIATE_TEST_SUITE_P(Spacings, AccuracyTest,
                         testing::Combine(testing::Values(1.0, 0.0303, 1e-9, 1e7), testing::Bool(),
                                          testing::Bool()),
                         NameOf);

// Volumes are floats, which end before these spacings do.
INSTANTIATE_TEST_SUITE_P(ExtremeSpacings, AccuracyTest,
                         testing::Combine(testing::Values(1e-55, 1e55), testing::Bool(),
                                          testing::Values(false)),
                         NameOf);

}  // namespace
}  // namespace partiemc
