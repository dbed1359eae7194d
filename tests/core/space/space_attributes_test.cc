// Attributes of particles at the points of surfaces.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/status.h"
#include "space/space_particles.h"
#include "space/surface_stream.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;
using support::SurfaceStream;

// A ball, a box and lone particles, far from the origin.
struct SpaceCloud {
  SpaceParticles particles;
  std::vector<float> linear, vector;

  SpaceCloud() {
    Random random(5);
    particles = support::Ball({0, 0, 0}, 6, .2, random);
    particles.Add(support::Box({12, -3, -3}, {17, 3, 3}, .2, random));
    for (const double x : {-14.3, -20.6}) particles.Add(Vec3{x, 1.2, .4});
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.xyz[3 * k] += 300;
      particles.xyz[3 * k + 1] -= 200;
      const Vec3 at = particles.At(k);
      linear.push_back(static_cast<float>(Linear(at)));
      vector.insert(vector.end(), {static_cast<float>(at.y), static_cast<float>(-at.x),
                                   static_cast<float>(at.z)});
    }
  }
  static double Linear(const Vec3& at) {
    return 5 + .25 * (at.x - 300) - .75 * (at.y + 200) + .5 * at.z;
  }
};

Surface SurfaceOf(const Frame& frame, SurfacePlacement placement) {
  SurfaceStream stream({.placement = placement});
  const absl::Status status = stream.Try(frame);
  EXPECT_TRUE(status.ok()) << status;
  return stream.surface();
}

class SpaceAttributes : public ::testing::TestWithParam<SurfacePlacement> {};
INSTANTIATE_TEST_SUITE_P(Placements, SpaceAttributes,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST_P(SpaceAttributes, ReproduceLinearFieldAtEveryPoint) {
  const SpaceCloud cloud;
  const std::vector<Attribute> attributes = {{"pressure", 1, cloud.linear},
                                             {"velocity", 3, cloud.vector}};
  Frame frame = cloud.particles.AsFrame();
  const Surface without = SurfaceOf(frame, GetParam());
  frame.attributes = attributes;
  Surface surface = SurfaceOf(frame, GetParam());
  ASSERT_EQ(surface.attributes.size(), 2u);
  EXPECT_EQ(surface.attributes[0].name, "pressure");
  EXPECT_EQ(surface.attributes[1].components, 3);
  ASSERT_GT(surface.PointCount(), 500u);
  ASSERT_EQ(surface.attributes[0].values.size(), surface.PointCount());
  ASSERT_EQ(surface.attributes[1].values.size(), 3 * surface.PointCount());
  // The values vary by 13 over the ball; the slope's ridge shows at the rim only.
  constexpr double kMost = .06;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    const Vec3 at = Vec3At(surface.points, k);
    if (at.x < 288) continue;  // A lone particle has no slope.
    EXPECT_NEAR(surface.attributes[0].values[k], SpaceCloud::Linear(at), kMost);
    EXPECT_NEAR(surface.attributes[1].values[3 * k], at.y, kMost);
    EXPECT_NEAR(surface.attributes[1].values[3 * k + 1], -at.x, kMost);
    EXPECT_NEAR(surface.attributes[1].values[3 * k + 2], at.z, kMost);
  }
  surface.attributes.clear();
  EXPECT_EQ(surface, without);
}

TEST_P(SpaceAttributes, HaveTheSameBitsForAnyOrderAndThreads) {
  SpaceCloud cloud;
  // Particles at one position near the surface. The sum of their values depends on the order.
  for (const float value : {1e30f, 1.0f, -1e30f, .3f}) {
    cloud.particles.Add(Vec3{305.5, -200, 0});
    cloud.linear.push_back(value);
    cloud.vector.insert(cloud.vector.end(), {value, 0, -value});
  }
  SpaceCloud reversed = cloud;
  const std::size_t count = cloud.particles.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = count - 1 - k;
    reversed.linear[k] = cloud.linear[from];
    for (std::size_t c = 0; c < 3; ++c) {
      reversed.particles.xyz[3 * k + c] = cloud.particles.xyz[3 * from + c];
      reversed.vector[3 * k + c] = cloud.vector[3 * from + c];
    }
  }
  std::vector<Surface> surfaces;
  for (const SpaceCloud* const one : {&cloud, &reversed}) {
    const std::vector<Attribute> attributes = {{"pressure", 1, one->linear},
                                               {"velocity", 3, one->vector}};
    Frame frame = one->particles.AsFrame();
    frame.attributes = attributes;
    for (const unsigned threads : {1u, 2u, 7u}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      Arena(threads).Execute([&] { surfaces.push_back(SurfaceOf(frame, GetParam())); });
    }
  }
  for (const Surface& surface : surfaces) EXPECT_EQ(surface, surfaces[0]);
}

TEST(SpaceAttributeValues, OfLoneParticlesAreTheirValuesAndLargestStayFinite) {
  const SpaceCloud cloud;
  constexpr float kLargest = std::numeric_limits<float>::max();
  std::vector<float> largest(cloud.particles.size(), kLargest);
  for (std::size_t k = 0; k < largest.size(); k += 2) largest[k] = -kLargest;
  const std::vector<Attribute> attributes = {{"pressure", 1, cloud.linear},
                                             {"largest", 1, largest}};
  Frame frame = cloud.particles.AsFrame();
  frame.attributes = attributes;
  const Surface surface = SurfaceOf(frame, SurfacePlacement::kVirtualPlane);
  std::size_t lone = 0;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    EXPECT_TRUE(std::isfinite(surface.attributes[1].values[k]));
    const double x = surface.points[3 * k];
    if (x >= 288) continue;
    const Vec3 particle{300 + (x < 282.5 ? -20.6 : -14.3), -198.8, .4};
    EXPECT_NEAR(surface.attributes[0].values[k], SpaceCloud::Linear(particle), 1e-3);
    ++lone;
  }
  EXPECT_GT(lone, 20u);
}

TEST(SpaceAttributeValues, KeepTheirNamesWithoutPointsAndRefusalsNameTheField) {
  SurfaceStream stream;
  const SpaceCloud cloud;
  const std::vector<Attribute> stress = {{"stress", 2, {}}};
  const Frame empty{.positions = std::span<const double>(), .components = 3, .attributes = stress};
  ASSERT_TRUE(stream.Try(empty).ok());
  ASSERT_EQ(stream.surface().attributes.size(), 1u);
  EXPECT_EQ(stream.surface().attributes[0].name, "stress");
  std::vector<float> bad = cloud.linear;
  bad[7] = std::nanf("");
  const std::span<const float> some(cloud.linear.data(), 5);
  for (const auto& [attribute, field, reason] :
       {std::tuple(Attribute{"p", 1, bad}, "attributes[0].values[7]", kReasonNotFinite),
        {Attribute{"p", 1, some}, "attributes[0].values", kReasonCount},
        {Attribute{"p", 4, cloud.linear}, "attributes[0].components", kReasonOutOfRange},
        {Attribute{"", 1, cloud.linear}, "attributes[0].name", kReasonOutOfRange}}) {
    Frame frame = cloud.particles.AsFrame();
    frame.attributes = std::span(&attribute, 1);
    const auto violation = FindViolation(stream.Try(frame));
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->field, field);
    EXPECT_EQ(violation->reason, reason);
    EXPECT_EQ(stream.surface(), Surface());
  }
}

}  // namespace
}  // namespace partiemc
