// The default placement as a whole, on shapes with a known truth.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <vector>

#include "core/internal/research.h"
#include "partiemc/partiemc.h"
#include "support/instruction_sets.h"
#include "support/random.h"

namespace partiemc {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Particles of spacing 1 in a disc: rings of them, each half a spacing inside of the next boundary,
// `noise` spacings off at random.
std::vector<double> NoisyDisc(double radius, double noise, std::uint64_t seed) {
  support::Random random(seed);
  std::vector<double> positions;
  for (double r = radius - 0.5; r > 0.2; r -= 1) {
    const int count = static_cast<int>(std::lround(2 * kPi * r));
    for (int k = 0; k < count; ++k) {
      const double angle = 2 * kPi * (k + 0.37 * r) / count;
      positions.push_back(r * std::cos(angle) + noise * random.Uniform(-1, 1));
      positions.push_back(r * std::sin(angle) + noise * random.Uniform(-1, 1));
    }
  }
  return positions;
}

Result Reconstructed(const std::vector<double>& positions, ReconstructionParameters parameters,
                     State& state, const VirtualPlaneVariant& variant = {}) {
  parameters.spacing = 1.0;
  const auto reconstructor = CreateVariant(parameters, variant);
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(
      {.positions = std::span<const double>(positions)}, state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(Validate(result).ok()) << Validate(result);
  return result;
}

Result Reconstructed(const std::vector<double>& positions,
                     const ReconstructionParameters& parameters = {},
                     const VirtualPlaneSteps& steps = {}) {
  State state;
  return Reconstructed(positions, parameters, state, {.steps = steps});
}

// Root mean square deviation of the first ring from its mean radius. Sampled along segments, so
// that the distribution of the vertices has no effect.
double Roughness(const Rings& rings) {
  constexpr int kSamples = 10;
  const std::span<const double> points = rings.RingPoints(0);
  const std::size_t count = points.size() / 2;
  double length = 0, sum = 0, square = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = (k + 1) % count;
    const double dx = points[2 * next] - points[2 * k];
    const double dy = points[2 * next + 1] - points[2 * k + 1];
    const double weight = std::hypot(dx, dy) / kSamples;
    for (int n = 0; n < kSamples; ++n) {
      const double t = (n + 0.5) / kSamples;
      const double r = std::hypot(points[2 * k] + t * dx, points[2 * k + 1] + t * dy);
      length += weight;
      sum += weight * r;
      square += weight * r * r;
    }
  }
  return std::sqrt(square / length - (sum / length) * (sum / length));
}

TEST(VirtualPlane, FindsTheRadiusOfADisc) {
  for (const double radius : {6.0, 10.0, 15.0}) {
    const Result result = Reconstructed(NoisyDisc(radius, 0, 1));
    ASSERT_EQ(result.rings.RingCount(), 1u);
    EXPECT_NEAR(std::sqrt(result.statistics.area / kPi), radius, 0.06) << radius;
    EXPECT_LT(Roughness(result.rings), 0.03) << radius;
  }
}

// Area of a disc without the area step; `steps` selects the other steps.
double DiscArea(double radius, VirtualPlaneSteps steps) {
  steps.area = false;
  const Result result = Reconstructed(NoisyDisc(radius, 0.05, 5), {}, steps);
  return result.rings.RingCount() == 1 ? result.rings.measures[0].area : -1;
}

// The kernel moves a boundary of curvature kappa by h^2 kappa / 2: around a disc these add up to
// pi h^2, whatever its radius.
TEST(VirtualPlane, CorrectsRoundingOfTheKernelOnADisc) {
  VirtualPlaneSteps steps, no_curvature;
  steps.support = no_curvature.support = no_curvature.curvature = false;
  for (const double radius : {6.0, 12.0, 24.0}) {
    EXPECT_NEAR(DiscArea(radius, steps) - DiscArea(radius, no_curvature), kPi, 0.15 * kPi)
        << radius;
  }
}

// Only the variation of the support along a ring counts.
TEST(VirtualPlane, MeanOfSupportDoesNotChangeTheArea) {
  VirtualPlaneSteps steps, no_support;
  no_support.support = false;
  for (const double radius : {6.0, 12.0, 24.0}) {
    EXPECT_NEAR(DiscArea(radius, steps), DiscArea(radius, no_support), 0.005 * 2 * kPi * radius)
        << radius;
  }
}

TEST(VirtualPlane, IsSmootherThanItsStartUnderNoise) {
  double rough = 0, smooth = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<double> positions = NoisyDisc(10, 0.2, seed);
    rough += Roughness(Reconstructed(positions, {}, VirtualPlaneSteps::None()).rings);
    smooth += Roughness(Reconstructed(positions).rings);
  }
  EXPECT_LT(smooth, 0.9 * rough);
}

TEST(VirtualPlane, MatchesKnownVolume) {
  const std::vector<double> positions = NoisyDisc(12, 0.1, 3);
  const auto volume = static_cast<double>(positions.size() / 2);
  const ReconstructionParameters small{.reference_radius = 0.78};  // About 0.06 spacings inward.
  const VirtualPlaneSteps unmatched{.area = false};
  const double before =
      std::abs(Reconstructed(positions, small, unmatched).statistics.area - volume);
  const double after = std::abs(Reconstructed(positions, small).statistics.area - volume);
  EXPECT_GT(before, 0.005 * volume);
  EXPECT_LT(after, 0.4 * before);
}

TEST(VirtualPlane, LimitsAndStoresChangeOfAreaOffset) {
  const std::vector<double> positions = NoisyDisc(12, 0.05, 4);
  const double change = VirtualPlaneConstants{}.area_change;
  State state;
  Reconstructed(positions, {}, state);
  ASSERT_TRUE(state.area_offset.has_value());
  const double target = *state.area_offset;
  for (const double side : {-1.0, 1.0}) {
    state.area_offset = target + side * 2.5 * change;
    Reconstructed(positions, {}, state);
    EXPECT_NEAR(*state.area_offset, target + side * 1.5 * change, 1e-12);
    Reconstructed(positions, {}, state);
    EXPECT_NEAR(*state.area_offset, target + side * 0.5 * change, 1e-12);
    Reconstructed(positions, {}, state);
    EXPECT_NEAR(*state.area_offset, target, 1e-12);
  }
}

TEST(VirtualPlane, SprayDoesNotCountForTheArea) {
  std::vector<double> positions = NoisyDisc(12, 0.05, 4);
  State alone, beside_spray;
  Reconstructed(positions, {}, alone);
  for (int k = 0; k < 100; ++k) {
    positions.insert(positions.end(), {30.0 + 10 * (k % 10), 30.0 + 10 * (k / 10)});
  }
  EXPECT_EQ(Reconstructed(positions, {}, beside_spray).rings.RingCount(), 101u);
  EXPECT_EQ(beside_spray.area_offset, alone.area_offset);
}

TEST(VirtualPlane, LimitsAreaOffsetForAnyVolume) {
  const std::vector<double> positions = NoisyDisc(12, 0.05, 5);
  for (const float volume : {0.5f, 1.5f}) {
    const std::vector<float> volumes(positions.size() / 2, volume);
    const auto reconstructor = Reconstructor::Create({.spacing = 1.0});
    State state;
    Workspace workspace;
    Result result;
    ASSERT_TRUE(
        reconstructor
            ->Reconstruct({.positions = std::span<const double>(positions), .volumes = volumes},
                          state, workspace, result)
            .ok());
    EXPECT_EQ(std::abs(*state.area_offset), VirtualPlaneConstants{}.area_limit);
  }
}

// Vertices on an axis. A tiny offset would move them to 1e-300, where products of two coordinates
// underflow to 0.
TEST(VirtualPlane, TinyOffsetLeavesVerticesOnAnAxis) {
  // A drop whose ring is too short to be refined, and has vertices at x = 0 exactly.
  const std::vector<double> positions = {0, 7.5, 0, 7.5};
  for (const double offset : {1e-300, -1e-300, 5e-324}) {
    State state{.cell_size = 1.0322265625, .spacing = 1, .area_offset = offset};
    const Result result = Reconstructed(positions, {}, state);
    EXPECT_EQ(state.area_offset, offset);
    std::size_t on_axis = 0;
    for (const double coordinate : result.rings.points) {
      EXPECT_TRUE(coordinate == 0 || std::abs(coordinate) > 1e-30) << coordinate;
      on_axis += coordinate == 0;
    }
    EXPECT_GE(on_axis, 1u);
  }
}

TEST(VirtualPlane, KeepsFewMoreVerticesThanMarchingSquares) {
  const std::vector<double> positions = NoisyDisc(15, 0.05, 6);
  const auto squares =
      Reconstructed(positions, {.placement = Placement::kMarchingSquares}).rings.PointCount();
  const auto planes = Reconstructed(positions).rings.PointCount();
  EXPECT_GE(planes, squares);
  EXPECT_LE(planes, squares + squares / 4);
}

// A ring of many stretches, and bodies of more points than one batch of the mesh.
TEST(VirtualPlane, SameBitsForAnyThreadsAndInstructionSet) {
  std::vector<double> positions = NoisyDisc(170, 0.2, 11);
  for (int k = 0; k < 60; ++k) {
    const std::vector<double> island = NoisyDisc(12, 0.2, k);
    for (std::size_t n = 0; n < island.size(); n += 2) {
      positions.push_back(island[n] + 200 + 30 * (k % 8));
      positions.push_back(island[n + 1] - 200 + 30 * (k / 8));
    }
  }
  std::vector<std::uint64_t> rings, meshes;
  const auto reconstruct = [&](int threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(threads);
    const Result result = arena.execute([&] { return Reconstructed(positions); });
    EXPECT_EQ(result.rings.RingCount(), 61u);
    rings.push_back(DigestRings(result.rings));
    meshes.push_back(DigestMesh(result.mesh));
  };
  for (const int threads : {1, 2, 7}) reconstruct(threads);
  support::ForEachInstructionSet([&] { reconstruct(2); });
  for (std::size_t k = 0; k < rings.size(); ++k) {
    EXPECT_EQ(rings[k], rings[0]);
    EXPECT_EQ(meshes[k], meshes[0]);
  }
}

// Ends and sides of an ellipse, 40 lattices at random angles, shaken: how far out each is drawn.
TEST(VirtualPlane, BendsDoNotDependOnTheKernelRadius) {
  constexpr double kA = 30, kB = 12;
  for (const double kernel_radius : {2.0, 3.0, 4.0, 6.0}) {
    double ends = 0, sides = 0;
    int end_count = 0, side_count = 0;
    for (int seed = 0; seed < 40; ++seed) {
      support::Random random(seed);
      const double angle = random.Uniform(0, kPi / 2);
      const double cosine = std::cos(angle), sine = std::sin(angle);
      const double from_x = random.Uniform(0, 1), from_y = random.Uniform(0, 1);
      std::vector<double> positions;
      for (int i = -45; i <= 45; ++i) {
        for (int j = -45; j <= 45; ++j) {
          const double u = i + from_x + random.Uniform(-.15, .15);
          const double v = j + from_y + random.Uniform(-.15, .15);
          const double x = cosine * u - sine * v, y = sine * u + cosine * v;
          if (x * x / (kA * kA) + y * y / (kB * kB) >= 1) continue;
          positions.push_back(x);
          positions.push_back(y);
        }
      }
      const Result result = Reconstructed(positions, {.kernel_radius = kernel_radius});
      const std::span<const double> points = result.rings.RingPoints(0);
      for (std::size_t k = 0; k < points.size(); k += 2) {
        const double x = points[k] / kA, y = points[k + 1] / kB;
        // To first order, the distance from the ellipse.
        const double distance = (x * x + y * y - 1) / (2 * std::hypot(x / kA, y / kB));
        if (std::abs(x) > .97) {
          ends += distance;
          ++end_count;
        } else if (std::abs(y) > .9) {
          sides += distance;
          ++side_count;
        }
      }
    }
    // Measured: -.02 for all radii. A correction that does not grow with the square of the radius
    // gives -.15 at 6.
    EXPECT_NEAR(ends / end_count, sides / side_count, .04) << "kernel radius " << kernel_radius;
  }
}

}  // namespace
}  // namespace partiemc
