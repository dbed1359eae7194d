// Particles of different sizes: the field against sums over all particles, guarantees, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/instruction_sets.h"
#include "support/particles.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/sized_scenes.h"
#include "support/stages.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;
using support::Stages;

const ReconstructionParameters kOwn{.spacing = 1.0, .sizes = Sizes::kOwn};

// A random scene whose sizes are within a factor of `ratio` of each other.
Particles RandomSizes(std::uint64_t seed, double ratio) {
  return support::RandomSizes(seed, 1 / std::sqrt(ratio), ratio);
}

// F by its equations (core/SIZES.md), as a sum over all particles in world units.
class SizedOracle {
 public:
  SizedOracle(const Particles& particles, const ReconstructionParameters& resolved)
      : particles_(particles), parameters_(resolved) {}

  double Value(double x, double y) const {
    const double beta = parameters_.kernel_radius, alpha = *parameters_.reference_radius;
    double sum = 0, size = 0, mx = 0, my = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t k = 0; k < particles_.size(); ++k) {
      const double h = std::sqrt(double{particles_.volumes[k]});
      const double dx = (particles_.x(k) - x) / h, dy = (particles_.y(k) - y) / h;
      const double square = (dx * dx + dy * dy) / (beta * beta);
      if (square >= 1) continue;
      const double w = std::pow(1 - square, 3);
      sum += w;
      size += w * h;
      mx += w * dx;
      my += w * dy;
      xx += w * dx * dx;
      xy += w * dx * dy;
      yy += w * dy * dy;
    }
    const double f = 4 / (std::numbers::pi * beta * beta) * sum;
    const double lone = 4 / (std::numbers::pi * beta * beta);
    const double f0 = parameters_.isovalue.value_or(std::min(.9 / (beta * beta), .7 * lone));
    const double f1 = parameters_.isovalue.value_or(.85);
    if (sum == 0) return std::min(std::max({beta - alpha, f0 * beta / 1.164}), f1 * beta / 1.164);
    const double half = (xx - yy) / 2;
    const double spread = ((xx + yy) / 2 + std::sqrt(half * half + xy * xy)) / (beta * beta * sum);
    const double limit = std::max(.21, 2.4 * alpha * alpha / (beta * beta));
    const double phi = std::hypot(mx, my) / sum - alpha;
    const double guard = (f0 - f) * beta / 1.164, gap = (spread - limit) * beta / .45;
    return size / sum * std::min(std::max({phi, guard, gap}), (f1 - f) * beta / 1.164);
  }

 private:
  const Particles& particles_;
  const ReconstructionParameters& parameters_;
};

// Relative to the largest kernel radius. Seen: 3e-7.
constexpr double kSizedFieldTolerance = 1e-5;

void ExpectFieldAgrees(std::uint64_t seed, double ratio, const ReconstructionParameters& wanted,
                       int& crossed, int& roots) {
  SCOPED_TRACE(testing::Message() << "seed " << seed << ", ratio " << ratio);
  Stages stages;
  stages.Run(support::Snapped(RandomSizes(seed, ratio), wanted.cell_size), wanted);
  const SizedOracle oracle(stages.particles, stages.parameters);
  const double cell = stages.scale.cell_size;
  const double tolerance = kSizedFieldTolerance * stages.scale.reach * cell;
  Random random(seed);
  for (int k = 0; k < 200; ++k) {
    auto tile = static_cast<std::uint32_t>(random.Below(stages.bins.tiles.size()));
    int i = static_cast<int>(random.Below(32)), j = static_cast<int>(random.Below(32));
    const auto& cells = stages.crossings.cells;
    if (random.Chance(.5) && !cells.empty()) {
      const ActiveCell& active = cells[random.Below(cells.size())];
      tile = active.tile;
      i = active.i;
      j = active.j;
    }
    const TileCoordinate& at = stages.bins.tiles[tile];
    const double truth = oracle.Value((32.0 * at.x + i) * cell, (32.0 * at.y + j) * cell);
    const auto value = [&](int di, int dj) {
      return stages.level_set.At(stages.bins.tiles, tile, i + di, j + dj);
    };
    if ((value(0, 0) < 0) != (value(1, 0) < 0) || (value(0, 0) < 0) != (value(0, 1) < 0)) {
      EXPECT_NEAR(value(0, 0) * cell, truth, tolerance);
      ++crossed;
    } else if (std::abs(truth) > tolerance) {
      EXPECT_EQ(value(0, 0) < 0, truth < 0);
    }
  }
  for (std::size_t k = 0; k < stages.planes.size(); k += 1 + stages.planes.size() / 50) {
    const CellPlane& plane = stages.planes[k];
    EXPECT_NEAR(plane.value * cell, oracle.Value(plane.point.x * cell, plane.point.y * cell),
                tolerance);
    ++roots;
  }
}

TEST(Sizes, FieldAgreesWithSumsOverAllParticles) {
  int crossed = 0, roots = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    ReconstructionParameters parameters = kOwn;
    parameters.kernel_radius = random.Uniform(1.5, 4);
    parameters.cell_size = random.Uniform(.5, 2);
    if (random.Chance(.2)) parameters.isovalue = .5;
    ExpectFieldAgrees(seed, std::array{1.0, 3.0, 10.0, 20.0}[seed % 4], parameters, crossed, roots);
  }
  EXPECT_GT(crossed, 300);
  EXPECT_GT(roots, 500);
}

TEST(Sizes, GradientAgreesWithDifferences) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Stages stages;
    stages.Run(support::Snapped(RandomSizes(seed, 4), 1), kOwn);
    Random random(seed);
    for (int k = 0; k < 100; ++k) {
      const auto tile = static_cast<std::uint32_t>(random.Below(stages.bins.tiles.size()));
      const double x = random.Uniform(.01, 31.9), y = random.Uniform(.01, 31.9);
      if (!stages.field.Covers(tile, x, y)) continue;
      constexpr double kStep = 1e-3;
      const auto at = [&](double dx, double dy) {
        const FieldSample sample = stages.field.Sample(tile, x + dx, y + dy);
        // Without the local size, whose gradient is left out.
        return sample.value / sample.size;
      };
      const FieldSample sample = stages.field.Sample(tile, x, y);
      if (!sample.has_support || std::abs(sample.mean_x) + std::abs(sample.mean_y) < .05) continue;
      const double size = sample.size;
      const double left = (at(0, 0) - at(-kStep, 0)) / kStep;
      const double right = (at(kStep, 0) - at(0, 0)) / kStep;
      if (std::abs(left - right) > .01) continue;  // Another term of F is next to the point.
      EXPECT_NEAR(sample.gradient_x / size, (left + right) / 2, 2e-3);
      const double slope = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
      if (std::abs(at(0, kStep) + at(0, -kStep) - 2 * at(0, 0)) / kStep > .01) continue;
      EXPECT_NEAR(sample.gradient_y / size, slope, 2e-3);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

// The largest distance of the points of rings from the nearest point of others.
double FarthestPoint(const Rings& rings, const Rings& others) {
  double farthest = 0;
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    double nearest = 1e300;
    for (std::size_t j = 0; j < others.PointCount(); ++j) {
      nearest = std::min(nearest, std::hypot(rings.points[2 * k] - others.points[2 * j],
                                             rings.points[2 * k + 1] - others.points[2 * j + 1]));
    }
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

TEST(Sizes, OwnSizesThatAreEqualGiveTheOutlineOfEqualSizes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    Particles particles = support::Blob(random, 14);
    particles.volumes.assign(particles.size(), 1);
    ReconstructionParameters equal = kOwn;
    equal.sizes = Sizes::kEqual;
    const Result own = ReconstructOnce(kOwn, particles);
    const Result expected = ReconstructOnce(equal, particles);
    ASSERT_EQ(own.rings.RingCount(), expected.rings.RingCount());
    EXPECT_LT(FarthestPoint(own.rings, expected.rings), 1e-2);
    EXPECT_NEAR(own.statistics.area, expected.statistics.area, 1e-4 * own.statistics.area);
  }
}

TEST(Sizes, ResultsKeepTheGuaranteesInRandomFrames) {
  for (std::uint64_t seed = 1; seed <= support::Tries(1'000u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    ReconstructionParameters parameters = kOwn;
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.2)) parameters.placement = Placement::kQef;
    if (random.Chance(.2)) parameters.kernel_radius = random.Uniform(1.5, 4);
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.7, 2);
    const double ratio = std::array{1.5, 3.0, 10.0, 20.0}[random.Below(4)];
    const Result result = ReconstructOnce(parameters, RandomSizes(seed, ratio));
    const absl::Status status = Validate(result, parameters.fill);
    EXPECT_TRUE(status.ok()) << status;
  }
}

TEST(Sizes, AnyNumberOfThreadsGivesTheSameBits) {
  const Particles particles = RandomSizes(7, 10);
  std::vector<std::uint64_t> digests;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Result result = ReconstructOnce(kOwn, particles);
    digests.push_back(DigestRings(result.rings));
  }
  EXPECT_EQ(digests[1], digests[0]);
  EXPECT_EQ(digests[2], digests[0]);
}

TEST(Sizes, AnyInstructionSetGivesTheSameBits) {
  const Particles particles = RandomSizes(7, 10);
  const std::uint64_t expected = DigestRings(ReconstructOnce(kOwn, particles).rings);
  support::ForEachInstructionSet(
      [&] { EXPECT_EQ(DigestRings(ReconstructOnce(kOwn, particles).rings), expected); });
}

TEST(Sizes, LargerUnitsScaleTheOutline) {
  const Particles particles = RandomSizes(3, 5);
  ReconstructionParameters small = kOwn;
  small.spacing = 1.0 / 64;
  Particles scaled = support::Scaled(particles, 1.0 / 64);
  const Rings rings = ReconstructOnce(kOwn, particles).rings;
  const Rings others = ReconstructOnce(small, scaled).rings;
  ASSERT_EQ(rings.points.size(), others.points.size());
  for (std::size_t k = 0; k < rings.points.size(); ++k) {
    ASSERT_EQ(rings.points[k], 64 * others.points[k]);
  }
}

// The violation of a refused frame; the state stays as it is.
TEST(Sizes, RefusesFramesWithoutVolumes) {
  const auto violation = RefusalOf(kOwn, support::Lattice(5, 5));
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->reason, kReasonCount);
  EXPECT_EQ(violation->field, "volumes");
  EXPECT_EQ(ReconstructOnce(kOwn, Particles()).rings.RingCount(), 0u);
}

TEST(Sizes, RefusesSizesFarFromTheSpacing) {
  Particles particles = support::Lattice(20, 20);
  particles.volumes.assign(particles.size(), 1);
  for (const float volume : {1e18f, 1e-6f, 101.0f, .0099f}) {
    particles.volumes[7] = volume;
    const auto violation = RefusalOf(kOwn, particles);
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation->reason, kReasonOutOfRange);
    EXPECT_EQ(violation->field, "volumes[7]");
  }
  for (const float volume : {100.0f, .01f}) {
    particles.volumes[7] = volume;
    ReconstructOnce(kOwn, particles);
  }
  // A wrong majority is named, too, not the particle whose size is allowed.
  particles.volumes.assign(particles.size(), .00390625f);
  particles.volumes[7] = 1;
  const auto violation = RefusalOf(kOwn, particles);
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->value, "0.00390625");
}

// Spray does not count in the area step, however large its particles are.
TEST(Sizes, LoneLargeParticlesLeaveTheBodyAlone) {
  Particles body = support::Disc(20);
  body.volumes.assign(body.size(), 1);
  const Result alone = ReconstructOnce(kOwn, body);
  const double count = static_cast<double>(body.size());
  for (int k = 0; k < 5; ++k) {
    body.Add(60 + 20 * k, 0);
    body.volumes.push_back(9);
  }
  const Result both = ReconstructOnce(kOwn, body);
  const auto largest = [](const Result& result) {
    return std::ranges::max(result.rings.measures, {}, &RingMeasures::area).area;
  };
  EXPECT_NEAR(largest(alone), count, .002 * count);
  EXPECT_NEAR(largest(both), largest(alone), 1e-9 * count);
}

TEST(Sizes, RefusesHugeSizeAlsoWithoutSpacing) {
  Particles particles = support::Lattice(20, 20);
  particles.volumes.assign(particles.size(), 1);
  particles.volumes[7] = 1e18f;
  ReconstructionParameters parameters = kOwn;
  parameters.spacing.reset();
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status =
      reconstructor->Reconstruct(particles.AsFrame(), state, workspace, result);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(FindViolation(status));
  EXPECT_EQ(FindViolation(status)->field, "volumes[7]");
  EXPECT_EQ(state, State());
}

TEST(Sizes, RefusesKernelsBeyondNeighbouringTiles) {
  Particles particles = support::Lattice(20, 20);
  particles.volumes.assign(particles.size(), 1);
  particles.volumes[3] = 30;  // A kernel radius of 44 cells.
  ReconstructionParameters parameters = kOwn;
  parameters.kernel_radius = 8;
  const auto violation = RefusalOf(parameters, particles);
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->field, "volumes[3]");
}

TEST(Sizes, RefusesWhatHasNoOwnSizes) {
  const auto field_of = [](const ReconstructionParameters& parameters) {
    const auto violation = FindViolation(Validate(parameters));
    return violation ? violation->field + "=" + violation->value : "";
  };
  ReconstructionParameters parameters = kOwn;
  parameters.slice = SlicePlane();
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = kOwn;
  parameters.noise_filter = .5;
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = kOwn;
  parameters.placement = Placement::kFarthestParticle;
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  EXPECT_EQ(field_of(kOwn), "");
}

TEST(Sizes, SpacingIsTheRootMeanSquareOfTheFirstFrame) {
  Particles particles = support::Lattice(20, 20);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.volumes.push_back(k % 2 == 0 ? 1.0f : 7.0f);
  }
  ReconstructionParameters parameters = kOwn;
  parameters.spacing.reset();
  const Result result = ReconstructOnce(parameters, particles);
  EXPECT_NEAR(result.statistics.spacing, 2, 1e-12);
  EXPECT_NEAR(result.statistics.cell_size, 2, 1e-12);
}

TEST(Sizes, LinearAttributesAreExact) {
  Random random(5);
  const auto draw = [](Random& of, double, double) { return of.Chance(.5) ? 1.0 : 2.5; };
  const Particles particles = support::Filled(support::DiscBody(12), random, draw);
  std::vector<float> values;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    values.push_back(static_cast<float>(2 + .5 * particles.x(k) - .25 * particles.y(k)));
  }
  const std::vector<Attribute> attributes{{.name = "a", .values = values}};
  Frame frame = particles.AsFrame();
  frame.attributes = attributes;
  ReconstructionParameters parameters = kOwn;
  parameters.spacing.reset();
  const Result result = ReconstructOnce(parameters, frame);
  const auto& points = result.mesh.points;
  ASSERT_EQ(result.attributes[0].values.size(), points.size() / 2);
  // The damping of slopes bounds the error.
  for (std::size_t k = 0; k < points.size() / 2; ++k) {
    EXPECT_NEAR(result.attributes[0].values[k], 2 + .5 * points[2 * k] - .25 * points[2 * k + 1],
                .05);
  }
}

TEST(Sizes, DoubtsFollowOwnSizes) {
  Random random(11);
  const auto draw = [](Random& of, double, double) { return of.Chance(.1) ? 4.0 : 1.0; };
  Particles particles = support::Filled(support::DiscBody(25), random, draw);
  ReconstructionParameters parameters = kOwn;
  parameters.spacing.reset();
  EXPECT_TRUE(ReconstructOnce(parameters, particles).statistics.doubts.empty());
  for (float& volume : particles.volumes) volume /= 9;
  EXPECT_TRUE(
      ReconstructOnce(parameters, particles).statistics.doubts.Has(Doubt::kSpacingContradicted));
}

}  // namespace
}  // namespace partiemc
