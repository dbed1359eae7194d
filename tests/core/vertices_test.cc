#include "vertices/vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/internal/research.h"
#include "partiemc/validate.h"
#include "support/oracle.h"
#include "support/particles.h"
#include "support/stages.h"
#include "vertices/placement.h"
#include "vertices/virtual_plane.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Stages;

const Segment& SegmentOf(const Stages& stages, std::size_t k) {
  return stages.crossings.segments[stages.topology.segments[k]];
}

VertexInput InputOf(const Stages& stages, const Frame& frame) {
  return {frame,        stages.bins,   stages.level_set,  stages.crossings, stages.topology,
          stages.field, stages.planes, stages.parameters, stages.variant,   stages.scale};
}

// Noise of both signs with many saddles, and particles that give the vertices gradients to follow.
struct NoisyStages : Stages {
  NoisyStages(std::uint64_t seed, Placement placement) {
    support::Random random(seed);
    variant.steps = VirtualPlaneSteps::None();
    RunOn(
        [seed](int x, int y) {
          if (x <= 0 || y <= 0 || x >= 63 || y >= 63) return 1.0;
          support::Random node(seed * 1'000'003 + static_cast<std::uint64_t>(y * 64 + x));
          return node.Uniform(-1, 1);
        },
        {0, 0}, {1, 1}, support::Shifted(support::Noise(random, 400, 30), 31, 31),
        {.placement = placement, .spacing = 1.0, .clean = false});
  }
};

TEST(Vertices, MarchingSquaresInterpolatesOnLatticeEdges) {
  support::Random random(1);
  Stages stages;
  stages.Run(support::Scaled(support::Blob(random, 9), 0.3),
             {.placement = Placement::kMarchingSquares, .spacing = 0.3, .cell_size = 0.7});
  const double cell_size = 0.3 * 0.7;
  ASSERT_EQ(stages.result.rings.PointCount(), stages.planes.size());
  for (std::size_t k = 0; k < stages.planes.size(); ++k) {
    const std::array<double, 4> f = stages.CornerValues(CellOf(stages, k));
    const int edge = SegmentOf(stages, k).entry;
    const double a = f[edge];
    const double b = f[(edge + 1) % 4];
    const double t = a / (a - b);
    if (t < 1e-3 || t > 1 - 1e-3) continue;  // Kept off the nodes.
    constexpr double kX[] = {0, 1, 1, 0};
    constexpr double kY[] = {0, 0, 1, 1};
    const Point origin = CellOrigin(stages.bins.tiles, CellOf(stages, k));
    const double x = origin.x + kX[edge] + t * (kX[(edge + 1) % 4] - kX[edge]);
    const double y = origin.y + kY[edge] + t * (kY[(edge + 1) % 4] - kY[edge]);
    EXPECT_NEAR(stages.result.rings.points[2 * k], x * cell_size, 1e-10);
    EXPECT_NEAR(stages.result.rings.points[2 * k + 1], y * cell_size, 1e-10);
  }
}

class VerticesInCells : public testing::TestWithParam<std::tuple<int, Placement>> {};

TEST_P(VerticesInCells, StayInsideTheirCellOrHalfOfASaddle) {
  const auto [seed, placement] = GetParam();
  const NoisyStages stages(static_cast<std::uint64_t>(seed), placement);
  int saddles = 0;
  ASSERT_GT(stages.planes.size(), 500u);
  for (std::size_t k = 0; k < stages.planes.size(); ++k) {
    const ActiveCell& cell = CellOf(stages, k);
    const Point origin = CellOrigin(stages.bins.tiles, cell);
    const std::uint32_t point = stages.placed.point_of_segment[k];
    const double u = stages.result.rings.points[2 * point] - origin.x;
    const double v = stages.result.rings.points[2 * point + 1] - origin.y;
    EXPECT_GT(std::min(u, v), 0);
    EXPECT_LT(std::max(u, v), 1);
    if (!cell.IsSaddle()) continue;
    // The segment cuts off the corner that its two edges share: edge k joins corners k and k + 1.
    ++saddles;
    const int entry = SegmentOf(stages, k).entry;
    const int exit = SegmentOf(stages, k).exit;
    const int corner = (entry + 1) % 4 == exit ? exit : entry;
    const double from_x = corner == 1 || corner == 2 ? 1 - u : u;
    const double from_y = corner >= 2 ? 1 - v : v;
    EXPECT_LT(from_x + from_y, 1);
  }
  EXPECT_GT(saddles, 50);
  EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
}

INSTANTIATE_TEST_SUITE_P(Seeds, VerticesInCells,
                         testing::Combine(testing::Range(1, 6),
                                          testing::Values(Placement::kVirtualPlane,
                                                          Placement::kQef)));

TEST(Vertices, VirtualPlaneRootsAreNearTheLevelSet) {
  support::Random random(2);
  Stages stages;
  stages.variant.steps = VirtualPlaneSteps::None();
  stages.Run(support::Snapped(support::Blob(random, 12), 1.0), {.spacing = 1.0});
  const support::FieldOracle oracle(stages.particles, stages.parameters, 1.0);
  double middles = 0, vertices = 0;
  for (std::size_t k = 0; k < stages.planes.size(); ++k) {
    const CellPlane& plane = stages.planes[k];
    middles += std::abs(oracle.Value({plane.point.x, plane.point.y}));
    const std::uint32_t point = stages.placed.point_of_segment[k];
    vertices += std::abs(oracle.Value(
        {stages.result.rings.points[2 * point], stages.result.rings.points[2 * point + 1]}));
  }
  EXPECT_LT(vertices, 0.2 * middles);
}

TEST(Vertices, VirtualPlaneTakesOneBoundedStep) {
  constexpr double kRounding = 1e-7;  // Of F and its gradient.
  const auto vertex = [](float value, float gx, float gy, bool weak = false) {
    CellPlane plane;
    plane.point = {10, 20};
    plane.value = value;
    plane.gradient_x = gx;
    plane.gradient_y = gy;
    plane.is_weak = weak;
    return VirtualPlaneVertex(plane, VirtualPlaneConstants{}.newton_step);
  };
  // F = value + g . d is zero at -value g / |g|^2.
  const Point plain = vertex(0.1f, 0.6f, 0.8f);
  EXPECT_NEAR(plain.x, 10 - 0.06, kRounding);
  EXPECT_NEAR(plain.y, 20 - 0.08, kRounding);
  const Point inward = vertex(-0.2f, 0, 2);
  EXPECT_NEAR(inward.x, 10, 1e-12);
  EXPECT_NEAR(inward.y, 20.1, kRounding);
  const Point longest = vertex(5, 1, 0);
  EXPECT_NEAR(longest.x, 10 - VirtualPlaneConstants{}.newton_step, 1e-12);
  EXPECT_NEAR(longest.y, 20, 1e-12);
  const Point weak = vertex(0.1f, 1, 1, true);
  EXPECT_EQ(weak.x, 10);
  EXPECT_EQ(weak.y, 20);
}

// One inside node at (10, 10), so that cell (10, 10) is cut at (10.5, 10) and (10, 10.5), and a
// lone particle. The normals of its level set point away from it.
struct Corner : Stages {
  Corner(double px, double py) {
    Particles particle;
    particle.Add(px, py);
    RunOn([](int x, int y) { return x == 10 && y == 10 ? -1.0 : 1.0; }, {0, 0}, {0, 0}, particle,
          {.placement = Placement::kQef, .spacing = 1.0, .clean = false});
  }
  std::size_t SegmentInCell(int i, int j) const {
    for (std::size_t k = 0; k < planes.size(); ++k) {
      if (CellOf(*this, k).i == i && CellOf(*this, k).j == j) return k;
    }
    ADD_FAILURE() << "no segment in cell " << i << ", " << j;
    return 0;
  }
};

TEST(Vertices, QefFindsCornerOfTwoLines) {
  for (const auto& [px, py] :
       {std::pair(10.1, 10.2), {10.15, 10.1}, {9.9, 10.1}, {10.386, 10.265}}) {
    const Corner corner(px, py);
    const Frame frame = corner.particles.AsFrame();
    const std::size_t k = corner.SegmentInCell(10, 10);
    // n . (v - p) = 0 for p = (10.5, 10), (10, 10.5), solved by Cramer's rule.
    const double ax = 10.5 - px, ay = 10 - py, bx = 10 - px, by = 10.5 - py;
    const double a = ax * 10.5 + ay * 10, b = bx * 10 + by * 10.5;
    const double determinant = ax * by - ay * bx;
    const Point vertex = QefVertex(InputOf(corner, frame), corner.planes[k]);
    EXPECT_NEAR(vertex.x, (a * by - ay * b) / determinant, 1e-5);
    EXPECT_NEAR(vertex.y, (ax * b - a * bx) / determinant, 1e-5);
  }
}

TEST(Vertices, QefStaysAtMiddleAlongFreeDirection) {
  // Far from the particle both normals are nearly equal, so only their common direction counts.
  const Corner corner(8.2, 8.2);
  const Frame frame = corner.particles.AsFrame();
  const std::size_t k = corner.SegmentInCell(10, 10);
  const Point vertex = QefVertex(InputOf(corner, frame), corner.planes[k]);
  EXPECT_NEAR(vertex.x, vertex.y, 1e-5);
  EXPECT_NEAR(vertex.x + vertex.y, 20.5, 0.1);
}

TEST(Vertices, QefClampsToTheCell) {
  bool clamped = false;
  for (const auto& [px, py] : {std::pair(10.386, 10.265), {10.265, 10.386}, {10.1, 10.2}}) {
    const Corner corner(px, py);
    const Frame frame = corner.particles.AsFrame();
    const std::size_t k = corner.SegmentInCell(10, 10);
    const std::uint32_t segment = corner.topology.segments[k];
    const Point free = QefVertex(InputOf(corner, frame), corner.planes[k]);
    const Point kept = ClampToCell(corner.bins.tiles, corner.planes[k].cell,
                                   corner.crossings.segments[segment], free);
    const auto within = [](double v) { return std::clamp(v, 10.0, 11.0); };
    EXPECT_NEAR(kept.x, within(free.x), 2e-3);
    EXPECT_NEAR(kept.y, within(free.y), 2e-3);
    clamped = clamped || std::hypot(kept.x - free.x, kept.y - free.y) > 0.01;
  }
  EXPECT_TRUE(clamped);
}

// Section 3.5 of the paper, computed directly from its equations by brute force.
TEST(Vertices, FarthestParticleAgreesWithBruteForce) {
  int picked = 0, none = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    const double cell = random.Uniform(0.6, 1.5);
    Particles particles = support::Blob(random, random.Uniform(5, 9));
    particles.Add(support::Noise(random, 30, 15));
    Stages stages;
    stages.Run(support::Snapped(particles, cell), {.placement = Placement::kFarthestParticle,
                                                   .spacing = 1.0,
                                                   .cell_size = cell,
                                                   .normal_memory = false});
    const support::FieldOracle oracle(stages.particles, stages.parameters, 1.0);
    for (std::size_t k = 0; k < stages.planes.size(); ++k) {
      const CellPlane& plane = stages.planes[k];
      const Point origin = CellOrigin(stages.bins.tiles, CellOf(stages, k));
      const auto mean = oracle.Mean({(origin.x + 0.5) * cell, (origin.y + 0.5) * cell});
      if (!mean) continue;
      const support::Vector gradient = oracle.PhiGradient(*mean);
      const double length = std::hypot(gradient.x, gradient.y);
      const double facing =
          (gradient.x * plane.OutwardX() + gradient.y * plane.OutwardY()) / length;
      if (length < 0.1 || std::abs(facing) < 1e-3) continue;
      const double sign = facing < 0 ? -1 : 1;
      const support::FarthestChoice choice = support::FarthestParticle(
          stages.particles, *mean, {sign * gradient.x / length, sign * gradient.y / length}, cell);
      if (choice.is_close_call) continue;
      const double x = stages.vertex_scratch.points[2 * k];
      const double y = stages.vertex_scratch.points[2 * k + 1];
      if (choice.particle) {
        EXPECT_EQ(x, stages.particles.x(*choice.particle));
        EXPECT_EQ(y, stages.particles.y(*choice.particle));
        ++picked;
      } else {
        EXPECT_NEAR(x, (plane.entry.x + plane.exit.x) / 2 * cell, 1e-12);
        EXPECT_NEAR(y, (plane.entry.y + plane.exit.y) / 2 * cell, 1e-12);
        ++none;
      }
    }
  }
  EXPECT_GT(picked, 300);
  EXPECT_GT(none, 10);
}

TEST(Vertices, FarthestParticleAddsSurfaceOffset) {
  support::Random random(3);
  const Particles particles = support::Scaled(support::Blob(random, 8), 0.1);
  Stages plain, moved;
  plain.Run(particles, {.placement = Placement::kFarthestParticle, .spacing = 0.1});
  moved.Run(particles,
            {.placement = Placement::kFarthestParticle, .spacing = 0.1, .surface_offset = 0.5});
  ASSERT_EQ(plain.planes.size(), moved.planes.size());
  for (std::size_t k = 0; k < plain.planes.size(); ++k) {
    EXPECT_NEAR(moved.vertex_scratch.points[2 * k] - plain.vertex_scratch.points[2 * k],
                0.05 * plain.planes[k].normal_x, 1e-12);
    EXPECT_NEAR(moved.vertex_scratch.points[2 * k + 1] - plain.vertex_scratch.points[2 * k + 1],
                0.05 * plain.planes[k].normal_y, 1e-12);
  }
}

TEST(Vertices, FarthestParticleDropsDuplicatesAndCollapsedRings) {
  Particles particles = support::Disc(8);
  particles.Add(30, 30);  // All cells round a lone particle choose it: no ring is left.
  Stages stages;
  stages.Run(particles, {.placement = Placement::kFarthestParticle, .spacing = 1.0});
  const Rings& rings = stages.result.rings;
  EXPECT_EQ(stages.topology.RingCount(), 2u);
  ASSERT_EQ(rings.RingCount(), 1u);
  EXPECT_EQ(rings.outer_of[0], kNoRing);
  const std::span<const double> points = rings.RingPoints(0);
  for (std::size_t k = 0; k < points.size(); k += 2) {
    const std::size_t next = (k + 2) % points.size();
    EXPECT_FALSE(points[k] == points[next] && points[k + 1] == points[next + 1]);
  }
  // Every segment refers to its vertex.
  for (std::size_t k = 0; k < stages.planes.size(); ++k) {
    const std::uint32_t point = stages.placed.point_of_segment[k];
    if (point == kNoPoint) {
      EXPECT_NEAR(stages.planes[k].point.x, 30, 2);
      continue;
    }
    EXPECT_EQ(rings.points[2 * point], stages.vertex_scratch.points[2 * k]);
    EXPECT_EQ(rings.points[2 * point + 1], stages.vertex_scratch.points[2 * k + 1]);
  }
}

TEST(Vertices, RingsAreMeasuredByTheirPolygons) {
  support::Random random(4);
  for (const Placement placement : AllPlacements()) {
    Stages stages;
    stages.Run(support::Shifted(support::Blob(random, 9), 1e5, -1e5),
               {.placement = placement, .spacing = 1.0});
    const Rings& rings = stages.result.rings;
    ASSERT_GT(rings.RingCount(), 0u);
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const std::span<const double> p = rings.RingPoints(ring);
      double area = 0, perimeter = 0, cx = 0, cy = 0;
      for (std::size_t k = 0; k < p.size(); k += 2) {
        const std::size_t next = (k + 2) % p.size();
        // Fans of triangles about (1e5, -1e5).
        const double ax = p[k] - 1e5, ay = p[k + 1] + 1e5;
        const double bx = p[next] - 1e5, by = p[next + 1] + 1e5;
        const double triangle = (ax * by - ay * bx) / 2;
        area += triangle;
        cx += triangle * (ax + bx) / 3;
        cy += triangle * (ay + by) / 3;
        perimeter += std::hypot(bx - ax, by - ay);
      }
      EXPECT_NEAR(rings.measures[ring].area, area, 1e-7);
      EXPECT_NEAR(rings.measures[ring].perimeter, perimeter, 1e-7);
      if (std::abs(area) < 0.1) continue;
      EXPECT_NEAR(rings.measures[ring].centroid_x, 1e5 + cx / area, 1e-6);
      EXPECT_NEAR(rings.measures[ring].centroid_y, -1e5 + cy / area, 1e-6);
    }
  }
}

}  // namespace
}  // namespace partiemc
