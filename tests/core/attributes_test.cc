// Attributes of particles at the vertices: exact where they are linear, safe where they are not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Particles of a disc of radius 12 with a hole, jittered, spacing 1, far from the origin.
struct Cloud {
  std::vector<float> positions;
  std::vector<float> linear, vector;

  explicit Cloud(double jitter) {
    std::mt19937 random(7);
    const auto offset = [&] {
      return jitter * (static_cast<double>(random()) / 4294967296.0 - 0.5);
    };
    for (int j = -14; j <= 14; ++j) {
      for (int i = -14; i <= 14; ++i) {
        const double x = i + offset(), y = j + offset();
        const double radius = std::hypot(x, y);
        if (radius > 12 || radius < 4) continue;
        positions.push_back(static_cast<float>(x + 300));
        positions.push_back(static_cast<float>(y - 200));
      }
    }
    for (std::size_t k = 0; k < Count(); ++k) {
      linear.push_back(static_cast<float>(Linear(positions[2 * k], positions[2 * k + 1])));
      vector.push_back(positions[2 * k + 1]);
      vector.push_back(-positions[2 * k]);
    }
  }
  std::size_t Count() const { return positions.size() / 2; }
  static double Linear(double x, double y) { return 5 + 0.25 * (x - 300) - 0.75 * (y + 200); }
};

Result Reconstructed(const Frame& frame,
                     const ReconstructionParameters& parameters = {.spacing = 1}) {
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

std::span<const double> VerticesOf(const Result& result) {
  return result.mesh.points.empty() ? result.rings.points : result.mesh.points;
}

TEST(Attributes, ReproducesLinearFieldAtEveryVertex) {
  const Cloud cloud(0.3);
  const std::vector<Attribute> attributes = {{"pressure", 1, cloud.linear},
                                             {"velocity", 2, cloud.vector}};
  for (const Fill fill : {Fill::kGreedy, Fill::kGrid, Fill::kPolygon, Fill::kNone}) {
    SCOPED_TRACE(static_cast<int>(fill));
    const Result result = Reconstructed({.positions = cloud.positions, .attributes = attributes},
                                        {.fill = fill, .spacing = 1});
    ASSERT_EQ(result.attributes.size(), 2);
    EXPECT_EQ(result.attributes[0].name, "pressure");
    EXPECT_EQ(result.attributes[1].components, 2);
    const std::span<const double> vertices = VerticesOf(result);
    ASSERT_GT(vertices.size(), 100);
    ASSERT_EQ(result.attributes[0].values.size(), vertices.size() / 2);
    ASSERT_EQ(result.attributes[1].values.size(), vertices.size());
    for (std::size_t k = 0; k < vertices.size() / 2; ++k) {
      const double x = vertices[2 * k], y = vertices[2 * k + 1];
      // The values vary by 18 over the body; the slope's ridge shows at the rim only.
      EXPECT_NEAR(result.attributes[0].values[k], Cloud::Linear(x, y), 0.04);
      EXPECT_NEAR(result.attributes[1].values[2 * k], y, 0.04);
      EXPECT_NEAR(result.attributes[1].values[2 * k + 1], -x, 0.04);
    }
  }
}

TEST(Attributes, KeepTheirNamesWithoutVertices) {
  const Cloud cloud(0.3);
  const auto reconstructor = Reconstructor::Create({.spacing = 1});
  State state;
  Workspace workspace;
  Result result;
  const std::vector<Attribute> attributes = {{"pressure", 1, cloud.linear}};
  ASSERT_TRUE(reconstructor
                  ->Reconstruct({.positions = cloud.positions, .attributes = attributes}, state,
                                workspace, result)
                  .ok());
  const std::vector<Attribute> others = {{"stress", 2, {}}};
  ASSERT_TRUE(reconstructor
                  ->Reconstruct({.positions = std::span<const float>(), .attributes = others},
                                state, workspace, result)
                  .ok());
  ASSERT_EQ(result.attributes.size(), 1u);
  EXPECT_EQ(result.attributes[0].name, "stress");
  EXPECT_EQ(result.attributes[0].components, 2);
  EXPECT_THAT(result.attributes[0].values, testing::IsEmpty());
}

TEST(Attributes, ChangeNothingElse) {
  const Cloud cloud(0.3);
  const std::vector<Attribute> attributes = {{"pressure", 1, cloud.linear}};
  const Result with = Reconstructed({.positions = cloud.positions, .attributes = attributes},
                                    {.spacing = 1, .attribute_tolerance = 1});
  const Result without = Reconstructed({.positions = cloud.positions});
  EXPECT_EQ(with.rings, without.rings);
  EXPECT_EQ(with.mesh, without.mesh);
  EXPECT_THAT(without.attributes, testing::IsEmpty());
}

TEST(Attributes, SameBitsForAnyNumberOfThreads) {
  const Cloud cloud(0.3);
  const std::vector<Attribute> attributes = {{"velocity", 2, cloud.vector}};
  const Frame frame{.positions = cloud.positions, .attributes = attributes};
  Result one, seven;
  Arena(1).Execute([&] { one = Reconstructed(frame); });
  Arena(7).Execute([&] { seven = Reconstructed(frame); });
  EXPECT_EQ(one.attributes, seven.attributes);
}

// Volumes are weights, as in the field: the heavier one of two overlapping halves counts more.
TEST(Attributes, WeightsParticlesByVolume) {
  std::vector<float> positions, values, volumes;
  for (int j = 0; j < 12; ++j) {
    for (int i = 0; i < 12; ++i) {
      for (const float value : {0.0f, 1.0f}) {
        positions.push_back(static_cast<float>(i));
        positions.push_back(static_cast<float>(j));
        values.push_back(value);
        volumes.push_back(value > 0 ? 0.75f : 0.25f);
      }
    }
  }
  const std::vector<Attribute> attributes = {{"share", 1, values}};
  const Result result =
      Reconstructed({.positions = positions, .volumes = volumes, .attributes = attributes});
  ASSERT_FALSE(result.attributes[0].values.empty());
  for (const float value : result.attributes[0].values) EXPECT_NEAR(value, 0.75, 1e-5);
}

// Slopes that few particles barely determine do not extrapolate far beyond the particles' values.
TEST(Attributes, DropsOfFewParticlesStayNearTheirValues) {
  const std::vector<float> positions = {0, 0, 0.02f, 0, 50, 0, 50, 1, 100, 0};
  const std::vector<float> values = {1, 2, 3, 4, 5};
  const std::vector<Attribute> attributes = {{"value", 1, values}};
  const Result result = Reconstructed({.positions = positions, .attributes = attributes});
  const std::span<const double> vertices = VerticesOf(result);
  ASSERT_GT(vertices.size(), 6);
  for (std::size_t k = 0; k < vertices.size() / 2; ++k) {
    const float value = result.attributes[0].values[k];
    const double x = vertices[2 * k];
    if (x < 25) {
      EXPECT_THAT(value, testing::AllOf(testing::Ge(0), testing::Le(3)));
    } else if (x < 75) {
      EXPECT_THAT(value, testing::AllOf(testing::Ge(2), testing::Le(5)));
    } else {
      EXPECT_FLOAT_EQ(value, 5);
    }
  }
}

TEST(Attributes, LargestValuesStayFinite) {
  const Cloud cloud(0.3);
  std::vector<float> values(cloud.Count());
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = (k % 2 == 0 ? 1 : -1) * std::numeric_limits<float>::max();
  }
  const std::vector<Attribute> attributes = {{"large", 1, values}};
  const Result result = Reconstructed({.positions = cloud.positions, .attributes = attributes});
  EXPECT_TRUE(std::ranges::all_of(result.attributes[0].values,
                                  [](float value) { return std::isfinite(value); }));
}

TEST(Attributes, RefusalsNameTheField) {
  const Cloud cloud(0);
  std::vector<float> spoiled = cloud.linear;
  spoiled[3] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> wide(cloud.Count() * 3);
  const Attribute good{"pressure", 1, cloud.linear};
  const std::string long_name(65, 'a');
  const std::vector<Attribute> many(11, {"wide", 3, wide});
  struct Case {
    std::vector<Attribute> attributes;
    std::string_view reason, field;
  };
  std::vector<Attribute> named;
  std::vector<std::string> names;
  for (int k = 0; k < 11; ++k) names.push_back("a" + std::to_string(k));
  for (const std::string& name : names) named.push_back({name, 3, wide});
  for (const Case& wrong :
       {Case{{{"", 1, cloud.linear}}, kReasonOutOfRange, "attributes[0].name"},
        Case{{{long_name, 1, cloud.linear}}, kReasonOutOfRange, "attributes[0].name"},
        Case{{{"\x1b[2J", 1, cloud.linear}}, kReasonOutOfRange, "attributes[0].name"},
        Case{{good, good}, kReasonDuplicate, "attributes[1].name"},
        Case{{{"x", 4, cloud.linear}}, kReasonOutOfRange, "attributes[0].components"},
        Case{{{"x", 2, cloud.linear}}, kReasonCount, "attributes[0].values"},
        Case{{{"x", 1, spoiled}}, kReasonNotFinite, "attributes[0].values[3]"},
        Case{named, kReasonOutOfRange, "attributes"}}) {
    SCOPED_TRACE(wrong.field);
    const auto reconstructor = Reconstructor::Create({.spacing = 1});
    State state;
    Workspace workspace;
    Result result;
    const absl::Status status = reconstructor->Reconstruct(
        {.positions = cloud.positions, .attributes = wrong.attributes}, state, workspace, result);
    const auto violation = FindViolation(status);
    ASSERT_TRUE(violation.has_value()) << status;
    EXPECT_EQ(violation->reason, wrong.reason);
    EXPECT_EQ(violation->field, wrong.field);
  }
}

}  // namespace
}  // namespace partiemc
