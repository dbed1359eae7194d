#include "bins/bins.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "partiemc/status.h"
#include "support/numbers.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::kInfinity;
using support::kNan;

Scale ScaleOf(double spacing, double kernel_radius, double cell_size) {
  const ReconstructionParameters parameters =
      Resolve({.spacing = spacing, .kernel_radius = kernel_radius, .cell_size = cell_size});
  return MakeScale(parameters, spacing, cell_size * spacing, spacing * spacing);
}

ParticleBins Bin(const support::Particles& particles, const Scale& scale) {
  ParticleBins bins;
  const absl::Status status = BinParticles(particles.AsFrame(), Plane::kXy, scale, {}, bins);
  EXPECT_TRUE(status.ok()) << status;
  return bins;
}

// Every fact about bins at once, for random frames and scales.
class RandomBins : public testing::TestWithParam<int> {
 protected:
  RandomBins() : random_(static_cast<std::uint64_t>(GetParam())) {
    scale_ = ScaleOf(1, random_.Uniform(1.5, 8), random_.Uniform(0.25, 4));
    particles_ = support::RandomScene(random_.Bits());
    bins_ = Bin(particles_, scale_);
  }

  // Calls visit(tile, particle, x, y) with positions in cells from the world's origin.
  template <typename Visit>
  void ForEachParticle(Visit visit) const {
    for (std::size_t tile = 0; tile < bins_.tiles.size(); ++tile) {
      for (std::uint32_t e = bins_.offsets[tile]; e < bins_.offsets[tile + 1]; ++e) {
        visit(tile, e, static_cast<double>(bins_.particles[e].x) + 32.0 * bins_.tiles[tile].x,
              static_cast<double>(bins_.particles[e].y) + 32.0 * bins_.tiles[tile].y);
      }
    }
  }

  support::Random random_;
  Scale scale_;
  support::Particles particles_;
  ParticleBins bins_;
};

TEST_P(RandomBins, EachParticleStandsInTheListOfTheTileThatItLiesInAndInNoOther) {
  std::vector<int> listed(particles_.size());
  ForEachParticle([&](std::size_t, std::uint32_t e, double, double) {
    const BinnedParticle& particle = bins_.particles[e];
    ++listed[particle.source];
    EXPECT_GE(std::min(particle.x, particle.y), 0);
    EXPECT_LT(std::max(particle.x, particle.y), kTileSize);
  });
  for (std::size_t k = 0; k < listed.size(); ++k) EXPECT_EQ(listed[k], 1) << "particle " << k;
}

TEST_P(RandomBins, EveryTileWhoseNodesOrCellsAKernelReachesExists) {
  for (std::size_t k = 0; k < particles_.size(); ++k) {
    const double x = particles_.x(k) / scale_.cell_size;
    const double y = particles_.y(k) / scale_.cell_size;
    const auto tile_of = [](double v) { return static_cast<std::int32_t>(std::floor(v / 32)); };
    for (std::int32_t ty = tile_of(y - scale_.kernel_radius);
         ty <= tile_of(y + scale_.kernel_radius); ++ty) {
      for (std::int32_t tx = tile_of(x - scale_.kernel_radius);
           tx <= tile_of(x + scale_.kernel_radius); ++tx) {
        EXPECT_NE(bins_.tiles.Find({ty, tx}), kNoTile) << "particle " << k;
      }
    }
  }
}

TEST_P(RandomBins, TilesReachACellAndTheRadiusOfASmallHoleBeyondEveryKernel) {
  // A disc of the area of six particles has a radius of sqrt(6 / pi) spacings.
  const double margin = 1 + std::sqrt(6 / std::acos(-1)) * scale_.spacing;
  const double reach = scale_.kernel_radius + margin - 1e-4;
  for (std::size_t k = 0; k < particles_.size(); ++k) {
    const double x = particles_.x(k) / scale_.cell_size;
    const double y = particles_.y(k) / scale_.cell_size;
    for (const auto& [dx, dy] : {std::pair(-1, -1), {-1, 1}, {1, -1}, {1, 1}}) {
      EXPECT_NE(bins_.tiles.Find({static_cast<std::int32_t>(std::floor((y + dy * reach) / 32)),
                                  static_cast<std::int32_t>(std::floor((x + dx * reach) / 32))}),
                kNoTile);
    }
  }
}

TEST_P(RandomBins, PositionsAreRoundedToAFractionOfACell) {
  ForEachParticle([&](std::size_t, std::uint32_t e, double x, double y) {
    const std::uint32_t k = bins_.particles[e].source;
    // Rounded to a multiple of 2^-17 cells: the error is at most half of it.
    EXPECT_NEAR(x, particles_.x(k) / scale_.cell_size, 0x1p-18 + 1e-9);
    EXPECT_NEAR(y, particles_.y(k) / scale_.cell_size, 0x1p-18 + 1e-9);
    EXPECT_EQ(x * 0x1p17, std::floor(x * 0x1p17));
    EXPECT_EQ(y * 0x1p17, std::floor(y * 0x1p17));
  });
}

TEST_P(RandomBins, ParticlesOfATileStandInTheOrderOfTheFrame) {
  ASSERT_EQ(bins_.offsets.size(), bins_.tiles.size() + 1);
  EXPECT_EQ(bins_.offsets.back(), bins_.particles.size());
  for (std::size_t tile = 0; tile < bins_.tiles.size(); ++tile) {
    for (std::uint32_t e = bins_.offsets[tile] + 1; e < bins_.offsets[tile + 1]; ++e) {
      EXPECT_LT(bins_.particles[e - 1].source, bins_.particles[e].source);
    }
  }
}

TEST_P(RandomBins, WeightsAreVolumesInUnitsOfTheKernel) {
  if (particles_.volumes.empty()) {
    EXPECT_TRUE(bins_.weight.empty());
    return;
  }
  ForEachParticle([&](std::size_t, std::uint32_t e, double, double) {
    const double radius = scale_.kernel_radius * scale_.cell_size;
    const double expected =
        particles_.volumes[bins_.particles[e].source] * 4 / (std::acos(-1) * radius * radius);
    EXPECT_NEAR(bins_.weight[e], expected, 1e-6 * expected);
  });
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomBins, testing::Range(1, 21));

TEST(Bins, AFrameWithoutParticlesHasNoTiles) {
  const ParticleBins bins = Bin({}, ScaleOf(1, 3, 1));
  EXPECT_EQ(bins.tiles.size(), 0u);
  EXPECT_TRUE(bins.particles.empty());
  EXPECT_EQ(bins.offsets, std::vector<std::uint32_t>{0});
}

TEST(Bins, ALoneParticleAMillionCellsAwayCostsAFewTilesAndNoBoundingBox) {
  support::Particles particles = support::Disc(5);
  const std::size_t before = Bin(particles, ScaleOf(1, 3, 1)).tiles.size();
  particles.Add(1e6, -1e6);
  EXPECT_LE(Bin(particles, ScaleOf(1, 3, 1)).tiles.size(), before + 4);
}

TEST(Bins, WhatAnEarlierFrameLeftBehindIsForgotten) {
  const Scale scale = ScaleOf(1, 3, 1);
  support::Particles weighted = support::Disc(8);
  weighted.volumes.assign(weighted.size(), 1.0f);
  ParticleBins bins = Bin(weighted, scale);
  const support::Particles next = support::Lattice(3, 3, 100, 100);
  ASSERT_TRUE(BinParticles(next.AsFrame(), Plane::kXy, scale, {}, bins).ok());
  const ParticleBins fresh = Bin(next, scale);
  ASSERT_EQ(bins.particles.size(), fresh.particles.size());
  for (std::size_t k = 0; k < fresh.particles.size(); ++k) {
    EXPECT_EQ(bins.particles[k].x, fresh.particles[k].x);
    EXPECT_EQ(bins.particles[k].source, fresh.particles[k].source);
  }
  EXPECT_EQ(bins.offsets, fresh.offsets);
  EXPECT_TRUE(bins.weight.empty());
}

TEST(Bins, MoreTilesThanAllowedAreRefusedWithAReason) {
  support::Particles particles;
  for (int k = 0; k < 100; ++k) particles.Add(1000.0 * k, 0);
  ParticleBins bins;
  const absl::Status status =
      BinParticles(particles.AsFrame(), Plane::kXy, ScaleOf(1, 3, 1), {.max_tiles = 50}, bins);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(FindViolation(status).has_value());
  EXPECT_EQ(FindViolation(status)->reason, kReasonTooManyTiles);
  EXPECT_EQ(FindViolation(status)->field, "positions");
}

TEST(Bins, AParticleBeyondTwoToTheThirtyCellsIsRefusedByName) {
  for (const auto& [x, y, field] :
       {std::tuple(1.1e9, 0.0, "positions[1].x"), std::tuple(0.0, -1.1e9, "positions[1].y")}) {
    support::Particles particles;
    particles.Add(0, 0);
    particles.Add(x, y);
    ParticleBins bins;
    const absl::Status status =
        BinParticles(particles.AsFrame(), Plane::kXy, ScaleOf(1, 3, 1), {}, bins);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    ASSERT_TRUE(FindViolation(status).has_value());
    EXPECT_EQ(FindViolation(status)->reason, kReasonOutOfRange);
    EXPECT_EQ(FindViolation(status)->field, field);
  }
}

// One bad frame, and the violation that CheckFrame reports.
struct BadFrame {
  std::string name;
  std::vector<double> positions;
  int components = 2;
  std::vector<float> volumes;
  std::string_view reason;
  std::string field;
  absl::StatusCode code = absl::StatusCode::kInvalidArgument;
  std::vector<std::uint64_t> ids = {};
  std::vector<float> velocities = {};
};

std::vector<double> With(std::size_t index, double value, std::size_t count = 40) {
  std::vector<double> positions(count);
  for (std::size_t k = 0; k < count; ++k) positions[k] = static_cast<double>(k / 2);
  positions[index] = value;
  return positions;
}

// Two good particles with these ids and velocities.
BadFrame BadTracks(std::string name, std::string_view reason, std::string field,
                   std::vector<std::uint64_t> ids, std::vector<float> velocities) {
  BadFrame bad{std::move(name), With(0, 0, 4), 2, {}, reason, std::move(field)};
  bad.ids = std::move(ids);
  bad.velocities = std::move(velocities);
  return bad;
}

std::vector<BadFrame> BadFrames() {
  return {
      {"NanInX", With(34, kNan), 2, {}, kReasonNotFinite, "positions[17].x"},
      {"InfinityInY", With(35, kInfinity), 2, {}, kReasonNotFinite, "positions[17].y"},
      {"MinusInfinity", With(0, -kInfinity), 2, {}, kReasonNotFinite, "positions[0].x"},
      {"Enormous", With(1, 1e70), 2, {}, kReasonOutOfRange, "positions[0].y"},
      {"NanInZ", With(5, kNan, 9), 3, {}, kReasonNotFinite, "positions[1].z"},
      {"OddCount", With(0, 0, 39), 2, {}, kReasonCount, "positions"},
      {"NotAMultipleOfThree", With(0, 0, 40), 3, {}, kReasonCount, "positions"},
      {"NotPlanar", {0, 0, 0, 1, 0, 0, 0, 1, 0.5}, 3, {}, kReasonNotPlanar, "positions[2].z"},
      {"FourComponents", With(0, 0), 4, {}, kReasonOutOfRange, "components"},
      {"OneComponent", With(0, 0), 1, {}, kReasonOutOfRange, "components"},
      {"NoComponents", With(0, 0), 0, {}, kReasonOutOfRange, "components"},
      {"NegativeComponents", With(0, 0), -2, {}, kReasonOutOfRange, "components"},
      {"TooFewVolumes", With(0, 0, 4), 2, {1.0f}, kReasonCount, "volumes"},
      {"VolumeZero", With(0, 0, 4), 2, {1.0f, 0.0f}, kReasonOutOfRange, "volumes[1]"},
      {"VolumeNegative", With(0, 0, 4), 2, {-1.0f, 1.0f}, kReasonOutOfRange, "volumes[0]"},
      {"VolumeNan",
       With(0, 0, 4),
       2,
       {1.0f, static_cast<float>(kNan)},
       kReasonNotFinite,
       "volumes[1]"},
      {"VolumeInfinite",
       With(0, 0, 4),
       2,
       {1.0f, static_cast<float>(kInfinity)},
       kReasonNotFinite,
       "volumes[1]"},
      BadTracks("TooFewIds", kReasonCount, "ids", {7}, {}),
      BadTracks("TooManyIds", kReasonCount, "ids", {1, 2, 3}, {}),
      BadTracks("AnIdTwice", kReasonDuplicate, "ids[1]", {7, 7}, {}),
      BadTracks("TooFewVelocities", kReasonCount, "velocities", {}, {1, 2, 3}),
      BadTracks("VelocitiesOfThreeComponents", kReasonCount, "velocities", {}, {1, 2, 3, 4, 5, 6}),
      BadTracks("VelocityNan", kReasonNotFinite, "velocities[1].x", {},
                {1, 2, static_cast<float>(kNan), 4}),
      BadTracks("VelocityInfinite", kReasonNotFinite, "velocities[0].y", {3, 9},
                {1, static_cast<float>(-kInfinity), 3, 4}),
      {"TooManyParticles",
       With(0, 0, 202),
       2,
       {},
       kReasonTooManyParticles,
       "positions",
       absl::StatusCode::kResourceExhausted},
  };
}

absl::Status Check(const Frame& frame, Plane plane, const FrameLimits& limits) {
  DistinctIdsScratch scratch;
  return CheckFrame(frame, {.plane = plane}, limits, scratch);
}

class BadFrameTest : public testing::TestWithParam<BadFrame> {};

TEST_P(BadFrameTest, IsRefusedWithReasonAndField) {
  const BadFrame& bad = GetParam();
  const Frame frame{.positions = std::span<const double>(bad.positions),
                    .components = bad.components,
                    .volumes = bad.volumes,
                    .ids = bad.ids,
                    .velocities = bad.velocities};
  const absl::Status status = Check(frame, Plane::kXy, {.max_particles = 100});
  EXPECT_EQ(status.code(), bad.code) << status;
  ASSERT_TRUE(FindViolation(status).has_value());
  EXPECT_EQ(FindViolation(status)->reason, bad.reason);
  EXPECT_EQ(FindViolation(status)->field, bad.field);
  EXPECT_FALSE(FindViolation(status)->value.empty());
  EXPECT_NE(FindViolation(status)->rule.find("must"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Bins, BadFrameTest, testing::ValuesIn(BadFrames()),
                         [](const auto& tested) { return tested.param.name; });

TEST(Bins, AGoodFrameOfAnyKindIsAccepted) {
  const std::vector<float> flat = {0, 0, 5, 1, 0, 5, 0, 1, 5};
  const std::vector<float> volumes = {1, 2, 3};
  const std::vector<std::uint64_t> ids = {5, ~0ull, 0};
  EXPECT_TRUE(Check({}, Plane::kXy, {}).ok());
  EXPECT_TRUE(Check({.positions = std::span<const float>(flat),
                     .components = 3,
                     .volumes = volumes,
                     .ids = ids,
                     .velocities = flat},
                    Plane::kXy, {.max_particles = 3})
                  .ok());
}

TEST(Bins, ThreeComponentsAreReadInTheirPlane) {
  const std::vector<double> xyz = {1, 2, 3};
  const std::vector<float> uvw = {4, 5, 6};
  const Frame frame{.positions = std::span<const double>(xyz), .components = 3, .velocities = uvw};
  const auto velocity = [&](Plane plane) {
    const PlaneVelocity read = VelocityOf(frame, plane, 0);
    return std::pair(read.x, read.y);
  };
  EXPECT_EQ(velocity(Plane::kXy), std::pair(4.0f, 5.0f));
  EXPECT_EQ(velocity(Plane::kXz), std::pair(4.0f, 6.0f));
  EXPECT_EQ(velocity(Plane::kYz), std::pair(5.0f, 6.0f));
  const auto read = [&](Plane plane) {
    const Point position = PositionOf(frame, plane, 0);
    return std::pair(position.x, position.y);
  };
  EXPECT_EQ(read(Plane::kXy), std::pair(1.0, 2.0));
  EXPECT_EQ(read(Plane::kXz), std::pair(1.0, 3.0));
  EXPECT_EQ(read(Plane::kYz), std::pair(2.0, 3.0));
}

TEST(Bins, ParticlesOutsideTheNamedPlaneAreToldByTheAxisThatVaries) {
  const std::vector<double> xyz = {0, 0, 0, 1, 0, 1, 2, 0, 2};
  const Frame frame{.positions = std::span<const double>(xyz), .components = 3};
  EXPECT_TRUE(Check(frame, Plane::kXz, {}).ok());
  EXPECT_EQ(FindViolation(Check(frame, Plane::kXy, {}))->field, "positions[2].z");
  EXPECT_EQ(FindViolation(Check(frame, Plane::kYz, {}))->field, "positions[2].x");
}

}  // namespace
}  // namespace partiemc
