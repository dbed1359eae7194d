// Sections of bodies in space by a plane: against bodies whose sections are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "field/slice_field.h"
#include "frame/scale.h"
#include "frame/slab.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "sampler/level_set_sampler.h"
#include "support/random.h"

namespace partiemc {
namespace {

using support::Random;
using Vector3 = std::array<double, 3>;

double Dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector3 operator*(double s, const Vector3& a) { return {s * a[0], s * a[1], s * a[2]}; }

// Particles in space, spacing 1.
struct SpaceCloud {
  std::vector<double> xyz;
  std::vector<std::uint64_t> ids;

  std::size_t size() const { return xyz.size() / 3; }
  Vector3 At(std::size_t k) const { return {xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]}; }
  void Add(const Vector3& p) { xyz.insert(xyz.end(), p.begin(), p.end()); }
  Frame AsFrame() const { return {.positions = std::span(xyz), .components = 3, .ids = ids}; }
};

using Solid = std::function<bool(const Vector3&)>;

// The nodes of a lattice that lie in a body within `extent` of the origin, turned and shifted at
// random, and each moved by up to `jitter` along each axis.
SpaceCloud CloudOf(const Solid& body, int extent, std::uint64_t seed, double jitter = 0) {
  Random random(seed);
  const auto any = [&] { return random.Uniform(-1, 1); };
  Vector3 a{any(), any(), any()}, b{any(), any(), any()};
  a = 1 / std::sqrt(Dot(a, a)) * a;
  b = b + -Dot(a, b) * a;
  b = 1 / std::sqrt(Dot(b, b)) * b;
  const Vector3 c{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const Vector3 shift{any(), any(), any()};
  SpaceCloud cloud;
  const int reach = static_cast<int>(extent * 1.8) + 2;
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      for (int k = -reach; k <= reach; ++k) {
        Vector3 p = shift + static_cast<double>(i) * a + static_cast<double>(j) * b +
                    static_cast<double>(k) * c;
        if (jitter > 0) p = p + jitter * Vector3{any(), any(), any()};
        if (body(p)) cloud.Add(p);
      }
    }
  }
  return cloud;
}

Solid Ball(double radius, const Vector3& centre = {}) {
  return [=](const Vector3& p) {
    const Vector3 d = p + -1.0 * centre;
    return Dot(d, d) < radius * radius;
  };
}

// Around the z axis.
Solid Torus(double middle, double radius) {
  return [=](const Vector3& p) {
    const double away = std::hypot(p[0], p[1]) - middle;
    return away * away + p[2] * p[2] < radius * radius;
  };
}

Solid Box(const Vector3& low, const Vector3& high) {
  return [=](const Vector3& p) {
    return p[0] > low[0] && p[1] > low[1] && p[2] > low[2] && p[0] < high[0] && p[1] < high[1] &&
           p[2] < high[2];
  };
}

ReconstructionParameters Slice(const SlicePlane& plane) { return {.spacing = 1, .slice = plane}; }

ReconstructionParameters AtHeight(double z) { return Slice({.origin = {0, 0, z}}); }

Result Reconstructed(const Frame& frame, const ReconstructionParameters& parameters) {
  const auto reconstructor = Reconstructor::Create(parameters);
  EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(Validate(result, parameters.fill).ok()) << Validate(result, parameters.fill);
  return result;
}

constexpr std::array kHeights = {-0.9, -0.7, -0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.7, 0.9};

// Relative errors of the sections' areas at kHeights, as means over three clouds, and their
// largest.
struct AreaErrors {
  std::array<double, kHeights.size()> mean{};
  double largest = 0;
};

AreaErrors ErrorsOf(const Solid& body, int extent, double radius, double jitter,
                    std::size_t ring_count, const std::function<double(double)>& area_at,
                    Placement placement = Placement::kVirtualPlane) {
  constexpr int kClouds = 3;
  AreaErrors errors;
  for (int seed = 1; seed <= kClouds; ++seed) {
    const SpaceCloud cloud = CloudOf(body, extent, seed, jitter);
    for (std::size_t k = 0; k < kHeights.size(); ++k) {
      const double z = kHeights[k] * radius;
      ReconstructionParameters parameters = AtHeight(z);
      parameters.placement = placement;
      const Result result = Reconstructed(cloud.AsFrame(), parameters);
      EXPECT_EQ(result.rings.RingCount(), ring_count) << "height " << z;
      const double error = result.statistics.area / area_at(z) - 1;
      errors.mean[k] += error / kClouds;
      errors.largest = std::max(errors.largest, std::abs(error));
    }
  }
  return errors;
}

void ExpectWithinAPercent(const std::string& name, const AreaErrors& errors) {
  for (std::size_t k = 0; k < kHeights.size(); ++k) {
    EXPECT_LT(std::abs(errors.mean[k]), 0.01) << "at " << kHeights[k] << " radii";
  }
  std::string figures;
  for (const double mean : errors.mean) figures += std::to_string(100 * mean) + " ";
  testing::Test::RecordProperty(name + "_mean_percent", figures);
  testing::Test::RecordProperty(name + "_largest_percent", std::to_string(100 * errors.largest));
}

TEST(Slice, AreasOfABallAreThoseOfItsDiscs) {
  for (const double jitter : {0.0, 0.15}) {
    SCOPED_TRACE(jitter);
    ExpectWithinAPercent(jitter > 0 ? "shaken_ball" : "ball",
                         ErrorsOf(Ball(20), 20, 20, jitter, 1,
                                  [](double z) { return std::numbers::pi * (400 - z * z); }));
  }
}

TEST(Slice, AreasOfATorusAreThoseOfItsRings) {
  ExpectWithinAPercent("torus", ErrorsOf(Torus(40, 20), 60, 20, 0, 2, [](double z) {
                         return 4 * std::numbers::pi * 40 * std::sqrt(400 - z * z);
                       }));
}

TEST(Slice, OtherPlacementsCutTheSameBall) {
  for (const Placement placement : {Placement::kMarchingSquares, Placement::kQef}) {
    SCOPED_TRACE(Name(placement));
    ExpectWithinAPercent(placement == Placement::kQef ? "qef" : "squares",
                         ErrorsOf(
                             Ball(20), 20, 20, 0, 1,
                             [](double z) { return std::numbers::pi * (400 - z * z); }, placement));
  }
}

TEST(Slice, TheBasisIsRightHandedAndNamesTheAxesThatPeopleExpect) {
  const auto basis = [](const Vector3& normal) { return BasisOf({.normal = normal}); };
  const Vector3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  EXPECT_EQ(basis({0, 0, 3}).first, x);
  EXPECT_EQ(basis({0, 0, 3}).second, y);
  EXPECT_EQ(basis({0, -1e-50, 0}).first, x);
  EXPECT_EQ(basis({0, -1e-50, 0}).second, z);
  EXPECT_EQ(basis({1e60, 0, 0}).first, y);
  EXPECT_EQ(basis({1e60, 0, 0}).second, z);
  for (const Vector3& normal : {Vector3{1, 2, 3}, Vector3{-5, 0.1, 2}, Vector3{1, 1, 1}}) {
    const auto [origin, u, v, n] = basis(normal);
    for (const Vector3& unit : {u, v, n}) EXPECT_NEAR(Dot(unit, unit), 1, 1e-14);
    EXPECT_NEAR(Dot(u, v), 0, 1e-14);
    EXPECT_NEAR(Dot(u, n), 0, 1e-14);
    EXPECT_NEAR(Dot(v, n), 0, 1e-14);
    EXPECT_GT(Dot(n, normal), 0);
    EXPECT_NEAR(u[0] * v[1] - u[1] * v[0], n[2], 1e-14);
  }
}

// A torus that stands on edge is cut where the other one is, with the plane turned alike.
TEST(Slice, APlaneMayLieAnyWay) {
  const SpaceCloud cloud = CloudOf(Torus(20, 10), 30, 5);
  const double turned = std::sqrt(0.5);
  SpaceCloud on_edge;
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    const Vector3 p = cloud.At(k);
    // Round the x axis, by 45 degrees, and away from the origin.
    on_edge.Add({p[0] + 300, turned * (p[1] - p[2]) - 200, turned * (p[1] + p[2]) + 100});
  }
  const Result flat = Reconstructed(cloud.AsFrame(), AtHeight(4));
  const Result leaning = Reconstructed(
      on_edge.AsFrame(),
      Slice({.origin = {300, -200 - 4 * turned, 100 + 4 * turned}, .normal = {0, -7, 7}}));
  ASSERT_EQ(flat.rings.RingCount(), 2);
  ASSERT_EQ(leaning.rings.RingCount(), 2);
  EXPECT_NEAR(leaning.statistics.area, flat.statistics.area, 1e-4 * flat.statistics.area);
  EXPECT_NEAR(leaning.rings.measures[0].centroid_x, flat.rings.measures[0].centroid_x, 1e-3);
  EXPECT_NEAR(leaning.rings.measures[0].centroid_y, flat.rings.measures[0].centroid_y, 1e-3);
}

TEST(Slice, BodiesAboveAndBelowThePlaneAreNotInIt) {
  // Two plates with a gap of four spacings, and a third plate that the plane cuts.
  SpaceCloud cloud = CloudOf(Box({-20, -20, 2}, {0, 20, 10}), 30, 1);
  for (const SpaceCloud& other : {CloudOf(Box({-20, -20, -10}, {0, 20, -2}), 30, 2),
                                  CloudOf(Box({8, -20, -10}, {28, 20, 10}), 40, 3)}) {
    cloud.xyz.insert(cloud.xyz.end(), other.xyz.begin(), other.xyz.end());
  }
  const Result result = Reconstructed(cloud.AsFrame(), AtHeight(0));
  ASSERT_EQ(result.rings.RingCount(), 1);
  EXPECT_NEAR(result.rings.measures[0].centroid_x, 18, 0.2);
  EXPECT_NEAR(result.statistics.area, 800, 16);
}

// As bodies in the plane do (core/METHOD.md, "Spurious contours"), whatever the angle of the plane.
TEST(Slice, PlatesApartByLessThanTwoSpacingsStayApart) {
  constexpr double kGap = 1.8;
  SpaceCloud cloud;
  for (int i = -20; i <= 20; ++i) {
    for (int j = -20; j <= 20; ++j) {
      for (int k = 0; k < 9; ++k) {
        for (const double side : {-1.0, 1.0}) {
          cloud.Add({i + 0.1, j + 0.2, side * (kGap / 2 + 0.5 + k)});
        }
      }
    }
  }
  for (const double angle : {0.0, 0.3, 0.7}) {
    SCOPED_TRACE(angle);
    const Result result =
        Reconstructed(cloud.AsFrame(), Slice({.normal = {std::sin(angle), 0, std::cos(angle)}}));
    ASSERT_EQ(result.rings.RingCount(), angle > 0 ? 2 : 0);
    // The gap is along the second axis.
    for (std::size_t ring = 0; ring < result.rings.RingCount(); ++ring) {
      const auto points = result.rings.RingPoints(ring);
      for (std::size_t k = 0; k < points.size(); k += 2) {
        EXPECT_EQ(points[k] > 0, points[0] > 0) << "ring " << ring;
      }
    }
  }
}

TEST(Slice, VolumesCount) {
  const SpaceCloud cloud = CloudOf(Ball(12), 12, 4);
  const std::vector<float> ones(cloud.size(), 1);
  Frame frame = cloud.AsFrame();
  const Result without = Reconstructed(frame, AtHeight(3));
  frame.volumes = ones;
  const Result with = Reconstructed(frame, AtHeight(3));
  EXPECT_NEAR(with.statistics.area, without.statistics.area, 1e-5 * without.statistics.area);
  const std::vector<float> light(cloud.size(), 0.01f);
  frame.volumes = light;
  EXPECT_TRUE(
      Reconstructed(frame, AtHeight(3)).statistics.doubts.Has(Doubt::kVolumesContradictSpacing));
}

TEST(Slice, UnitsDoNotMatter) {
  const SpaceCloud cloud = CloudOf(Ball(12), 12, 4);
  const Result usual = Reconstructed(cloud.AsFrame(), AtHeight(3));
  for (const double unit : {1.0 / 1024, 65536.0}) {
    SpaceCloud scaled = cloud;
    for (double& value : scaled.xyz) value *= unit;
    const std::vector<float> volumes(cloud.size(), static_cast<float>(unit * unit * unit));
    ReconstructionParameters parameters = AtHeight(3 * unit);
    parameters.spacing = unit;
    Frame frame = scaled.AsFrame();
    for (const bool with_volumes : {false, true}) {
      if (with_volumes) frame.volumes = volumes;
      const double area = Reconstructed(frame, parameters).statistics.area;
      EXPECT_NEAR(area / unit / unit, usual.statistics.area, 1e-5 * usual.statistics.area);
    }
  }
}

TEST(Slice, ALinearFieldIsReproducedAtVertices) {
  const SpaceCloud cloud = CloudOf(Ball(15), 15, 6, 0.2);
  const auto linear = [](double x, double y, double z) { return 7 + 0.3 * x - 0.5 * y + 0.8 * z; };
  std::vector<float> values;
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    const Vector3 p = cloud.At(k);
    values.push_back(static_cast<float>(linear(p[0], p[1], p[2])));
  }
  const std::vector<Attribute> attributes = {{"pressure", 1, values}};
  Frame frame = cloud.AsFrame();
  frame.attributes = attributes;
  for (const double z : {-12.0, 0.3, 9.0}) {
    ReconstructionParameters parameters = AtHeight(z);
    parameters.fill = Fill::kGrid;
    const Result result = Reconstructed(frame, parameters);
    const std::vector<double>& points = result.mesh.points;
    ASSERT_GT(points.size(), 100);
    ASSERT_EQ(result.attributes[0].values.size(), points.size() / 2);
    for (std::size_t k = 0; 2 * k < points.size(); ++k) {
      const double is = linear(points[2 * k], points[2 * k + 1], z);
      // Relative to the range over the body.
      EXPECT_NEAR(result.attributes[0].values[k], is, 0.01 * 30) << "vertex " << k;
    }
  }
}

TEST(Slice, TheSameBitsForAnyNumberOfThreads) {
  const SpaceCloud cloud = CloudOf(Torus(40, 20), 60, 2);
  std::vector<std::uint64_t> digests;
  for (const int threads : {1, 3}) {
    Arena arena(threads);
    arena.Execute([&] {
      const Result result = Reconstructed(cloud.AsFrame(), AtHeight(5));
      digests.push_back(DigestRings(result.rings));
      digests.push_back(DigestMesh(result.mesh));
    });
  }
  EXPECT_EQ(digests[0], digests[2]);
  EXPECT_EQ(digests[1], digests[3]);
}

TEST(Slice, RingsKeepTheirIdentities) {
  SpaceCloud cloud = CloudOf(Ball(10, {-15, 0, 0}), 30, 1);
  const SpaceCloud other = CloudOf(Ball(10, {15, 0, 0}), 30, 2);
  cloud.xyz.insert(cloud.xyz.end(), other.xyz.begin(), other.xyz.end());
  for (std::size_t k = 0; k < cloud.size(); ++k) cloud.ids.push_back(k);
  const auto reconstructor = Reconstructor::Create(AtHeight(0));
  State state;
  Workspace workspace;
  Result result;
  std::vector<std::uint64_t> first;
  for (int frame = 0; frame < 4; ++frame) {
    ASSERT_TRUE(reconstructor->Reconstruct(cloud.AsFrame(), state, workspace, result).ok());
    ASSERT_EQ(result.rings.RingCount(), 2);
    std::vector<std::uint64_t> identities;
    for (const RingMeasures& measures : result.rings.measures) {
      identities.push_back(measures.identity);
    }
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
    for (std::size_t k = 0; k < cloud.size(); ++k) cloud.xyz[3 * k + 2] += 1.5;
  }
}

TEST(Slice, ParticlesThatTheKernelDoesNotReachCostNothing) {
  const SpaceCloud cloud = CloudOf(Box({-10, -10, -40}, {10, 10, 40}), 45, 1);
  Slab slab;
  slab.Take(cloud.AsFrame(), {.origin = {0, 0, 5}}, 3);
  EXPECT_EQ(slab.heights().size(), slab.AsFrame().ParticleCount());
  EXPECT_NEAR(static_cast<double>(slab.heights().size()), 20 * 20 * 6, 120);
  for (const double height : slab.heights()) EXPECT_LT(std::abs(height), 3);
  // A plane away from all particles gives an empty result, not an error.
  const Result result = Reconstructed(cloud.AsFrame(), AtHeight(1000));
  EXPECT_EQ(result.rings.RingCount(), 0);
  EXPECT_EQ(result.statistics.particles, cloud.size());
}

// Every branch of the level set, and so each kind of gradient.
TEST(Slice, GradientsAreThoseOfTheLevelSet) {
  // The lower plate leans, so that the gap opens and closes along the plane.
  SpaceCloud cloud = CloudOf(Box({-20, -8, 0.9}, {20, 8, 10}), 30, 1, 0.1);
  const SpaceCloud below = CloudOf(
      [](const Vector3& p) {
        return std::abs(p[0]) < 20 && std::abs(p[1]) < 8 && p[2] < -0.8 - 0.05 * p[0] && p[2] > -9;
      },
      30, 2, 0.1);
  cloud.xyz.insert(cloud.xyz.end(), below.xyz.begin(), below.xyz.end());
  const ReconstructionParameters parameters = Resolve(AtHeight(0));
  const Scale scale = MakeScale(parameters, 1, 1, 1);
  Slab slab;
  slab.Take(cloud.AsFrame(), *parameters.slice, 3);
  ParticleBins bins;
  ASSERT_TRUE(BinParticles(slab.AsFrame(), Plane::kXy, scale, {}, bins).ok());
  SetHeights(slab.heights(), scale, bins);
  LevelSet level_set;
  SampleSlice(bins, scale, level_set);
  Crossings crossings;
  FindCrossings(bins.tiles, level_set, crossings);
  LevelSetSampler sampler;
  sampler.Build(bins, crossings, scale, 2, false);

  Random random(3);
  int by_phi = 0, by_gap = 0, by_density = 0;
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    for (int k = 0; k < 500; ++k) {
      const double x = random.Uniform(1, 31), y = random.Uniform(1, 31);
      if (!sampler.Covers(tile, x, y)) continue;
      const FieldSample at = sampler.Sample(tile, x, y);
      if (!at.has_support) continue;
      constexpr double kStep = 1e-4;
      const auto value = [&](double dx, double dy) {
        return sampler.Sample(tile, x + dx, y + dy).value;
      };
      const double slope_x = (value(kStep, 0) - value(-kStep, 0)) / (2 * kStep);
      const double slope_y = (value(0, kStep) - value(0, -kStep)) / (2 * kStep);
      // Where two branches meet, differences are of both.
      const double curved_x = value(kStep, 0) - 2 * at.value + value(-kStep, 0);
      const double curved_y = value(0, kStep) - 2 * at.value + value(0, -kStep);
      if (std::abs(curved_x) + std::abs(curved_y) > 1e-6) continue;
      EXPECT_NEAR(at.gradient_x, slope_x, 2e-3 * (1 + std::abs(slope_x)));
      EXPECT_NEAR(at.gradient_y, slope_y, 2e-3 * (1 + std::abs(slope_y)));
      if (at.value == at.phi) {
        ++by_phi;
      } else if (at.value == (at.spread - scale.gap_spread) * scale.gap_slope) {
        ++by_gap;
      } else {
        ++by_density;
      }
    }
  }
  EXPECT_GT(by_phi, 50);
  EXPECT_GT(by_gap, 50);
  EXPECT_GT(by_density, 20);
}

std::string FieldOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  return violation ? violation->field : std::string(status.message());
}

TEST(Slice, WhatCannotBeCutIsRefused) {
  const auto refused = [](const ReconstructionParameters& parameters) {
    return FieldOf(Reconstructor::Create(parameters).status());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused({.slice = SlicePlane{}}), "parameters.spacing");
  EXPECT_EQ(
      refused({.placement = Placement::kFarthestParticle, .spacing = 1, .slice = SlicePlane{}}),
      "parameters.placement");
  EXPECT_EQ(refused(Slice({.normal = {0, 0, 0}})), "parameters.slice.normal");
  EXPECT_EQ(refused(Slice({.normal = {0, nan, 1}})), "parameters.slice.normal_y");
  EXPECT_EQ(refused(Slice({.origin = {0, 0, 1e70}})), "parameters.slice.origin_z");

  const auto reconstructor = Reconstructor::Create(AtHeight(0));
  State state;
  Workspace workspace;
  Result result;
  const std::vector<double> flat = {0, 0, 1, 0, 2, 0};
  EXPECT_EQ(FieldOf(reconstructor->Reconstruct({.positions = std::span<const double>(flat)}, state,
                                               workspace, result)),
            "components");
  const std::vector<float> far = {0, 0, 0, 1e12f, 0, 0};
  EXPECT_EQ(
      FieldOf(reconstructor->Reconstruct(
          {.positions = std::span<const float>(far), .components = 3}, state, workspace, result)),
      "positions");
}

}  // namespace
}  // namespace partiemc
