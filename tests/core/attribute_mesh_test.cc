// The mesh of `greedy` represents attributes: within the tolerance, without T-junctions, and with
// far fewer triangles than `grid`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/point.h"
#include "base/predicates.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/validate.h"

namespace partiemc {
namespace {

using Function = std::function<double(double, double)>;

constexpr double kRadius = 60;  // Spacings.

// Jittered particles of a disc, with a value each.
struct Body {
  std::vector<float> positions, values;

  explicit Body(const Function& field, double radius = kRadius) {
    std::mt19937 random(3);
    const auto offset = [&] { return .3 * (static_cast<double>(random()) / 4294967296.0 - .5); };
    const int reach = static_cast<int>(radius) + 1;
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        const double x = i + offset(), y = j + offset();
        if (std::hypot(x, y) > radius) continue;
        positions.push_back(static_cast<float>(x));
        positions.push_back(static_cast<float>(y));
        values.push_back(static_cast<float>(field(x, y)));
      }
    }
  }
};

Result MeshOf(const Body& body, ReconstructionParameters parameters = {}) {
  parameters.spacing = 1;
  const std::vector<Attribute> attributes = {{"value", 1, body.values}};
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(
      {.positions = body.positions, .attributes = attributes}, state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

Point PointAt(const Mesh& mesh, std::uint32_t k) {
  return {mesh.points[2 * k], mesh.points[2 * k + 1]};
}

// Calls visit(point, value) at points of a lattice of a quarter of a spacing in each triangle.
template <typename Visit>
void ForEachSample(const Result& result, const Visit& visit) {
  const Mesh& mesh = result.mesh;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    Point corners[3];
    double values[3];
    for (int c = 0; c < 3; ++c) {
      corners[c] = PointAt(mesh, mesh.triangles[k + c]);
      values[c] = result.attributes[0].values[mesh.triangles[k + c]];
    }
    const auto& [a, b, c] = corners;
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area <= 0) continue;
    const auto [left, right] = std::minmax({a.x, b.x, c.x});
    const auto [low, high] = std::minmax({a.y, b.y, c.y});
    for (double y = std::ceil(4 * low) / 4; y <= high; y += .25) {
      for (double x = std::ceil(4 * left) / 4; x <= right; x += .25) {
        const double u = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / area;
        const double v = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        visit(Point{x, y}, u * values[0] + v * values[1] + (1 - u - v) * values[2]);
      }
    }
  }
}

double MeanError(const Result& result, const Function& field) {
  double sum = 0;
  std::size_t count = 0;
  ForEachSample(result, [&](const Point& p, double value) {
    sum += std::abs(value - field(p.x, p.y));
    ++count;
  });
  EXPECT_GT(count, 10'000u);
  return sum / static_cast<double>(count);
}

// A field with values from 0 to 1.
struct Field {
  std::string name;
  Function at;
};

std::vector<Field> Fields() {
  return {{"linear", [](double x, double y) { return .5 + (.6 * x + .8 * y) / (2 * kRadius); }},
          {"radial", [](double x, double y) { return std::hypot(x, y) / kRadius; }},
          {"step of phase", [](double x, double y) { return x + .3 * y > 5 ? 1.0 : 0.0; }},
          {"vortex",  // The speed of a Lamb-Oseen vortex.
           [](double x, double y) {
             const double r = std::max(std::hypot(x - 10, y + 5), 1e-9) / 12;
             return 1.567 * (1 - std::exp(-r * r)) / r;
           }},
          {"boundary layer",
           [](double, double y) { return 1 - std::exp(-std::max(0.0, y + kRadius) / 8); }}};
}

class AttributeMesh : public ::testing::TestWithParam<Field> {};

TEST_P(AttributeMesh, IsAccurateWithAThirdOfTheTrianglesOfGrid) {
  const auto& [name, field] = GetParam();
  const Body body(field);
  const Result mesh = MeshOf(body), grid = MeshOf(body, {.fill = Fill::kGrid});
  const double error = MeanError(mesh, field), error_of_grid = MeanError(grid, field);
  std::printf("%s: mean error %.4f, of grid %.4f; %lu triangles of %lu\n", name.c_str(), error,
              error_of_grid, static_cast<unsigned long>(mesh.mesh.TriangleCount()),
              static_cast<unsigned long>(grid.mesh.TriangleCount()));
  EXPECT_LE(error, .02);
  EXPECT_LE(mesh.mesh.TriangleCount(), grid.mesh.TriangleCount() / 3);
  EXPECT_EQ(CountTJunctions(mesh), 0u);
  EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus());
  EXPECT_EQ(mesh.rings, grid.rings);
}

// Both results know the values at the nodes that the coarse mesh has left out.
TEST_P(AttributeMesh, DeviatesFromEachNodeByTheToleranceAtMost) {
  const Body body(GetParam().at);
  const Result grid = MeshOf(body, {.fill = Fill::kGrid});
  std::map<std::pair<double, double>, double> nodes;
  double least = INFINITY, most = -INFINITY;
  for (std::size_t k = grid.rings.points.size() / 2; k < grid.mesh.points.size() / 2; ++k) {
    const double value = grid.attributes[0].values[k];
    nodes[{grid.mesh.points[2 * k], grid.mesh.points[2 * k + 1]}] = value;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  for (const double tolerance : {.001, .01, .1}) {
    const Result mesh = MeshOf(body, {.attribute_tolerance = tolerance});
    std::size_t compared = 0;
    double largest = 0;
    ForEachSample(mesh, [&](const Point& p, double value) {
      const auto node = nodes.find({p.x, p.y});
      if (node == nodes.end()) return;
      largest = std::max(largest, std::abs(value - node->second));
      ++compared;
    });
    EXPECT_GT(compared, nodes.size());
    EXPECT_LE(largest, tolerance * (most - least) + 1e-6) << tolerance;
  }
}

INSTANTIATE_TEST_SUITE_P(Fields, AttributeMesh, ::testing::ValuesIn(Fields()), [](const auto& of) {
  std::string name = of.param.name;
  std::ranges::replace(name, ' ', '_');
  return name;
});

TEST(AttributeMeshes, ShowASubmergedDrop) {
  // 32 particles of another phase, 20 spacings below the surface.
  const Function phase = [](double x, double y) {
    return std::hypot(x - 3.3, y + 39.7) < 3.2 ? 1.0 : 0.0;
  };
  const Body body(phase);
  ASSERT_NEAR(std::count(body.values.begin(), body.values.end(), 1.f), 32, 3);
  const Result mesh = MeshOf(body);
  double area = 0;  // Of values above one half.
  ForEachSample(mesh, [&](const Point&, double value) { area += value > .5 ? 1. / 16 : 0; });
  EXPECT_NEAR(area, M_PI * 3.2 * 3.2, .15 * M_PI * 3.2 * 3.2);
  EXPECT_LE(mesh.mesh.TriangleCount(), mesh.statistics.triangles_grid / 3);
}

TEST(AttributeMeshes, OfNoiseAreTheGrid) {
  std::mt19937 random(5);
  const Body body([&](double, double) { return static_cast<double>(random() % 1000); }, 20);
  const Result mesh = MeshOf(body, {.attribute_tolerance = 0});
  const Result grid = MeshOf(body, {.fill = Fill::kGrid});
  EXPECT_GE(mesh.mesh.TriangleCount(), grid.mesh.TriangleCount());
  EXPECT_EQ(CountTJunctions(mesh), 0u);
}

TEST(AttributeMeshes, OfAConstantHaveAFewLargeBlocks) {
  const Body body([](double, double) { return 7.0; });
  const Result mesh = MeshOf(body);
  EXPECT_LE(mesh.mesh.TriangleCount(), mesh.statistics.triangles_grid / 5);
  EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus());
}

TEST(AttributeMeshes, WithToleranceOneAreThoseWithoutAttributes) {
  const Body body([](double x, double y) { return std::sin(x / 7) + y; });
  Body bare = body;
  const Result with = MeshOf(body, {.attribute_tolerance = 1});
  const auto reconstructor = Reconstructor::Create({.spacing = 1});
  State state;
  Workspace workspace;
  Result without;
  ASSERT_TRUE(
      reconstructor->Reconstruct({.positions = body.positions}, state, workspace, without).ok());
  EXPECT_EQ(with.mesh, without.mesh);
  EXPECT_EQ(with.rings, without.rings);
}

TEST(AttributeMeshes, HaveTheSameBitsForAnyNumberOfThreads) {
  const Body body(Fields()[3].at);
  std::vector<std::uint64_t> digests;
  for (const int threads : {1, 2, 5}) {
    Arena arena(threads);
    arena.Execute([&] { digests.push_back(DigestMesh(MeshOf(body).mesh)); });
  }
  EXPECT_THAT(digests, ::testing::Each(digests[0]));
}

TEST(AttributeMeshes, OfManyShapesAreValid) {
  std::mt19937 random(11);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int round = 0; round < 60; ++round) {
    // Discs at random places, which touch, overlap and leave holes.
    Body body([](double, double) { return 0.0; }, 0);
    body.positions.clear();
    body.values.clear();
    const int discs = 1 + static_cast<int>(9 * uniform());
    for (int d = 0; d < discs; ++d) {
      const double cx = 60 * uniform(), cy = 60 * uniform(), r = 2 + 12 * uniform();
      for (double y = -r; y <= r; ++y) {
        for (double x = -r; x <= r; ++x) {
          if (x * x + y * y > r * r) continue;
          body.positions.push_back(static_cast<float>(cx + x + .2 * uniform()));
          body.positions.push_back(static_cast<float>(cy + y + .2 * uniform()));
          body.values.push_back(static_cast<float>(std::sin(cx + x) * r + cy));
        }
      }
    }
    for (const double tolerance : {.01, .2}) {
      const Result mesh = MeshOf(body, {.attribute_tolerance = tolerance});
      EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus()) << round;
    }
  }
}

}  // namespace
}  // namespace partiemc
