// The mesh of `greedy` represents attributes: within the tolerance, without T-junctions, and with
// far fewer triangles than `grid`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
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

constexpr double kBodyRadius = 60;  // Spacings.

// Jittered particles of a disc, with a value each.
struct Body {
  std::vector<float> positions, values;

  explicit Body(const Function& field, double radius = kBodyRadius) {
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

Result MeshedBody(const Body& body, ReconstructionParameters parameters = {}) {
  parameters.spacing = 1;
  const auto components = static_cast<int>(2 * body.values.size() / body.positions.size());
  const std::vector<Attribute> attributes = {{"value", components, body.values}};
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

constexpr int kLength = -1;

double ValueAt(const AttributeValues& attribute, std::size_t vertex, int component) {
  const float* const components = &attribute.values[vertex * attribute.components];
  return component == kLength ? std::hypot(components[0], components[1]) : components[component];
}

// A lattice of points, a quarter of a spacing apart. `kAside` avoids the edges between triangles of
// blocks, so that each point lies in one triangle.
constexpr double kSampleDistance = .25, kSampleArea = 1. / 16;
constexpr Point kOnNodes = {0, 0}, kAside = {.1, .17};

// Calls visit(point, value) at the points of a lattice in each triangle; `component` of the values,
// or the length of a vector, interpolated from the vertices.
template <typename Visit>
void ForEachSample(const Result& result, const Point& offset, int component, const Visit& visit) {
  const Mesh& mesh = result.mesh;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    Point corners[3];
    double values[3];
    for (int c = 0; c < 3; ++c) {
      corners[c] = PointAt(mesh, mesh.triangles[k + c]);
      values[c] = ValueAt(result.attributes[0], mesh.triangles[k + c], component);
    }
    const auto& [a, b, c] = corners;
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area <= 0) continue;
    const auto [left, right] = std::minmax({a.x, b.x, c.x});
    const auto [low, high] = std::minmax({a.y, b.y, c.y});
    const auto first = [](double from, double along) {
      return std::ceil((from - along) / kSampleDistance) * kSampleDistance + along;
    };
    for (double y = first(low, offset.y); y <= high; y += kSampleDistance) {
      for (double x = first(left, offset.x); x <= right; x += kSampleDistance) {
        const double u = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / area;
        const double v = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        visit(Point{x, y}, u * values[0] + v * values[1] + (1 - u - v) * values[2]);
      }
    }
  }
}

double MeanError(const Result& result, const Function& field, int component = 0) {
  double sum = 0;
  std::size_t count = 0;
  ForEachSample(result, kAside, component, [&](const Point& p, double value) {
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
  return {{"linear", [](double x, double y) { return .5 + (.6 * x + .8 * y) / (2 * kBodyRadius); }},
          {"radial", [](double x, double y) { return std::hypot(x, y) / kBodyRadius; }},
          {"step of phase", [](double x, double y) { return x + .3 * y > 5 ? 1.0 : 0.0; }},
          {"vortex",  // The speed of a Lamb-Oseen vortex.
           [](double x, double y) {
             const double r = std::max(std::hypot(x - 10, y + 5), 1e-9) / 12;
             return 1.567 * (1 - std::exp(-r * r)) / r;
           }},
          {"boundary layer",
           [](double, double y) { return 1 - std::exp(-std::max(0.0, y + kBodyRadius) / 8); }}};
}

class AttributeMesh : public ::testing::TestWithParam<Field> {};

TEST_P(AttributeMesh, IsAccurateWithAThirdOfTheTrianglesOfGrid) {
  const auto& [name, field] = GetParam();
  const Body body(field);
  const Result mesh = MeshedBody(body), grid = MeshedBody(body, {.fill = Fill::kGrid});
  const double error = MeanError(mesh, field), error_of_grid = MeanError(grid, field);
  std::printf("%s: mean error %.4f, of grid %.4f; %lu triangles of %lu\n", name.c_str(), error,
              error_of_grid, static_cast<unsigned long>(mesh.mesh.TriangleCount()),
              static_cast<unsigned long>(grid.mesh.TriangleCount()));
  EXPECT_LE(error, .02);
  EXPECT_LE(mesh.mesh.TriangleCount(), grid.mesh.TriangleCount() / 3);
  EXPECT_EQ(CountTJunctions(mesh), 0u);
  EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus());
  EXPECT_EQ(mesh.rings, grid.rings);
  EXPECT_EQ(mesh.statistics.triangles_grid, grid.mesh.TriangleCount());
}

// The mesh of `grid` has the values at the nodes that the coarse mesh omits.
TEST_P(AttributeMesh, DeviatesFromEachNodeByTheToleranceAtMost) {
  const Body body(GetParam().at);
  const Result grid = MeshedBody(body, {.fill = Fill::kGrid});
  std::map<std::pair<double, double>, double> nodes;
  double least = INFINITY, most = -INFINITY;
  for (std::size_t k = grid.rings.points.size() / 2; k < grid.mesh.points.size() / 2; ++k) {
    const double value = grid.attributes[0].values[k];
    nodes[{grid.mesh.points[2 * k], grid.mesh.points[2 * k + 1]}] = value;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  for (const double tolerance : {.001, .01, .1}) {
    const Result mesh = MeshedBody(body, {.attribute_tolerance = tolerance});
    std::size_t compared = 0;
    double largest = 0;
    ForEachSample(mesh, kOnNodes, 0, [&](const Point& p, double value) {
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

// 30 particles of another phase, 20 spacings below the surface. The kernel smooths the phase, so
// the area of values above one half is 16 % smaller than the drop in the finest mesh, too. The
// default mesh must have the area of this smooth field.
TEST(AttributeMeshes, ShowASubmergedDrop) {
  const Function phase = [](double x, double y) {
    return std::hypot(x - 3.3, y + 39.7) < 3.2 ? 1.0 : 0.0;
  };
  const Body body(phase);
  ASSERT_EQ(std::count(body.values.begin(), body.values.end(), 1.f), 30);
  const auto area = [](const Result& result) {
    double sum = 0;
    ForEachSample(result, kAside, 0,
                  [&](const Point&, double value) { sum += value > .5 ? kSampleArea : 0; });
    return sum;
  };
  const Result mesh = MeshedBody(body);
  const double fine = area(MeshedBody(body, {.fill = Fill::kGrid, .cell_size = .25}));
  std::printf("drop: area above .5 %.2f, in a fine grid %.2f\n", area(mesh), fine);
  EXPECT_NEAR(area(mesh), fine, .05 * fine);
  EXPECT_NEAR(area(mesh), 30, 6);
  EXPECT_GT(*std::ranges::max_element(mesh.attributes[0].values), .95);
  EXPECT_LE(mesh.mesh.TriangleCount(), mesh.statistics.triangles_grid / 3);
  EXPECT_LT(area(MeshedBody(body, {.attribute_tolerance = 1})), .1 * fine);
}

// Large blocks are tested at few nodes, and a drop may lie between them.
TEST(AttributeMeshes, ShowADropAtAnyPlace) {
  for (int k = 0; k < 16; ++k) {
    const double cx = -23 + 3.1 * k, cy = 19 - 2.3 * k;
    const Result mesh = MeshedBody(
        Body([&](double x, double y) { return std::hypot(x - cx, y - cy) < 2.6 ? 1.0 : 0.0; }));
    EXPECT_GT(*std::ranges::max_element(mesh.attributes[0].values), .85) << cx << ", " << cy;
  }
}

// The speed of a rigid rotation is a cone, although both components are linear.
TEST(AttributeMeshes, RepresentTheLengthOfVectors) {
  Body body([](double, double) { return 0; });
  body.values.clear();
  for (std::size_t k = 0; k < body.positions.size(); k += 2) {
    body.values.insert(body.values.end(), {-body.positions[k + 1], body.positions[k]});
  }
  const Result mesh = MeshedBody(body);
  const Function speed = [](double x, double y) { return std::hypot(x, y); };
  EXPECT_LE(MeanError(mesh, speed, kLength), .02 * kBodyRadius);
  double largest = 0;  // At the centre, where the speed has a tip.
  ForEachSample(mesh, kAside, kLength, [&](const Point& p, double value) {
    largest = std::max(largest, std::abs(value - speed(p.x, p.y)));
  });
  EXPECT_LE(largest, .02 * 2 * kBodyRadius);
  EXPECT_LE(MeanError(
                mesh, [](double, double y) { return -y; }, 0),
            .001 * kBodyRadius);
  EXPECT_LE(mesh.mesh.TriangleCount(), mesh.statistics.triangles_grid / 3);
}

TEST(AttributeMeshes, OfNoiseAreTheGrid) {
  std::mt19937 random(5);
  const Body body([&](double, double) { return static_cast<double>(random() % 1000); }, 20);
  const Result mesh = MeshedBody(body, {.attribute_tolerance = 0});
  const Result grid = MeshedBody(body, {.fill = Fill::kGrid});
  EXPECT_GE(mesh.mesh.TriangleCount(), grid.mesh.TriangleCount());
  EXPECT_EQ(CountTJunctions(mesh), 0u);
}

TEST(AttributeMeshes, OfTheLargestFloatsAreValid) {
  std::mt19937 random(7);
  const float most = std::numeric_limits<float>::max();
  Body body([&](double, double) { return random() % 2 == 0 ? most : -most; }, 20);
  body.values.insert(body.values.end(), body.values.rbegin(), body.values.rend());
  for (const double tolerance : {0., .01, .9}) {
    const Result mesh = MeshedBody(body, {.attribute_tolerance = tolerance});
    EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus()) << tolerance;
  }
}

TEST(AttributeMeshes, OfAConstantHaveAFewLargeBlocks) {
  const Body body([](double, double) { return 7.0; });
  const Result mesh = MeshedBody(body);
  EXPECT_LE(mesh.mesh.TriangleCount(), mesh.statistics.triangles_grid / 5);
  EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus());
}

// The square root of 2 is no float, so sums of lengths round.
TEST(AttributeMeshes, OfAConstantVectorAreThoseOfAConstant) {
  Body body([](double, double) { return 1.0; });
  const Result scalar = MeshedBody(body);
  body.values.insert(body.values.end(), body.values.begin(), body.values.end());
  EXPECT_EQ(MeshedBody(body).mesh, scalar.mesh);
}

TEST(AttributeMeshes, WithToleranceOneAreThoseWithoutAttributes) {
  const Body body([](double x, double y) { return std::sin(x / 7) + y; });
  const Result with = MeshedBody(body, {.attribute_tolerance = 1});
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
    arena.Execute([&] { digests.push_back(DigestMesh(MeshedBody(body).mesh)); });
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
      const Result mesh = MeshedBody(body, {.attribute_tolerance = tolerance});
      EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus()) << round;
    }
    const Placement placement = AllPlacements()[round % AllPlacements().size()];
    const Result mesh = MeshedBody(body, {.placement = placement});
    if (KeepsGuarantees(placement)) {
      EXPECT_EQ(Validate(mesh, Fill::kConforming), absl::OkStatus()) << round;
    }
    const Result grid = MeshedBody(body, {.placement = placement, .fill = Fill::kGrid});
    EXPECT_EQ(mesh.statistics.triangles_grid, grid.mesh.TriangleCount()) << round;
  }
}

}  // namespace
}  // namespace partiemc
