// Outlines at walls: guarantees, exact lines and corners, refusals.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/instruction_sets.h"
#include "support/particles.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::HeightAbove;
using support::Particles;
using support::PolygonWall;
using support::Random;
using support::ReconstructOnce;

double Height(const std::vector<Wall>& walls, double x, double y) {
  double height = 1e300;
  for (const Wall& wall : walls) height = std::min(height, HeightAbove(wall, x, y));
  return height;
}

double X(const Rings& rings, std::size_t point) { return rings.points[2 * point]; }
double Y(const Rings& rings, std::size_t point) { return rings.points[2 * point + 1]; }

bool HasPoint(const Rings& rings, double x, double y) {
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    if (X(rings, k) == x && Y(rings, k) == y) return true;
  }
  return false;
}

// The largest distance between the points of two outlines; they must be as many.
double FarthestOf(const Rings& a, const Rings& b) {
  EXPECT_EQ(a.points.size(), b.points.size());
  double farthest = 0;
  for (std::size_t k = 0; k < std::min(a.points.size(), b.points.size()); ++k) {
    farthest = std::max(farthest, std::abs(a.points[k] - b.points[k]));
  }
  return farthest;
}

std::size_t NextOf(const Rings& rings, std::size_t point) {
  const auto after = std::ranges::upper_bound(rings.offsets, point);
  return point + 1 < *after ? point + 1 : *(after - 1);
}

const ReconstructionParameters kTank{.spacing = 1.0, .walls = {{{0, 30, 0, 0, 20, 0, 20, 30}}}};

// Particles half a spacing from the walls of kTank.
Particles Column() { return support::Lattice(20, 12, .5, .5); }

TEST(Walls, AColumnInATankIsARectangle) {
  const Result result = ReconstructOnce(kTank, Column());
  const Rings& rings = result.rings;
  ASSERT_EQ(rings.RingCount(), 1u);
  EXPECT_TRUE(HasPoint(rings, 0, 0));
  EXPECT_TRUE(HasPoint(rings, 20, 0));
  ASSERT_EQ(rings.contacts.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t contact = rings.contacts[k];
    EXPECT_TRUE(X(rings, contact) == 0 || X(rings, contact) == 20) << X(rings, contact);
    EXPECT_NEAR(Y(rings, contact), 12, .02);
    EXPECT_NEAR(rings.contact_angles[k], std::numbers::pi / 2, .02);
  }
  // Every wetted segment is on a wall, bit for bit, and they cover the walls up to the contacts.
  double wetted = 0;
  for (const std::uint32_t k : rings.wetted) {
    const std::size_t next = NextOf(rings, k);
    EXPECT_TRUE((X(rings, k) == X(rings, next) && (X(rings, k) == 0 || X(rings, k) == 20)) ||
                (Y(rings, k) == Y(rings, next) && Y(rings, k) == 0));
    wetted += std::hypot(X(rings, next) - X(rings, k), Y(rings, next) - Y(rings, k));
  }
  EXPECT_NEAR(wetted, 44, .05);
  EXPECT_NEAR(result.statistics.area, 240, .1);
  EXPECT_NEAR(result.statistics.perimeter, 64, .1);
}

TEST(Walls, AFullTankHasTheOutlineOfItsWalls) {
  const Wall tank{{0, 12, 0, 0, 20, 0, 20, 12}};
  const Result result = ReconstructOnce({.spacing = 1.0, .walls = {tank}}, Column());
  ASSERT_EQ(result.rings.RingCount(), 1u);
  EXPECT_EQ(result.rings.wetted.size(), result.rings.PointCount());
  EXPECT_TRUE(result.rings.contacts.empty());
  EXPECT_EQ(result.statistics.area, 240);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_TRUE(HasPoint(result.rings, tank.points[2 * k], tank.points[2 * k + 1])) << k;
  }
}

// The rings of the column in the tank, without the particles that an obstacle replaces.
Rings ColumnAround(const Wall& obstacle) {
  ReconstructionParameters parameters = kTank;
  parameters.walls.push_back(obstacle);
  Particles particles;
  const Particles column = Column();
  for (std::size_t k = 0; k < column.size(); ++k) {
    if (HeightAbove(obstacle, column.x(k), column.y(k)) > 0) {
      particles.Add(column.x(k), column.y(k));
    }
  }
  return ReconstructOnce(parameters, particles).rings;
}

TEST(Walls, AnObstacleLeavesItsOwnHole) {
  const Wall square{{7.3, 4.1, 7.3, 8.2, 12.6, 8.2, 12.6, 4.1}};
  const Rings rings = ColumnAround(square);
  ASSERT_EQ(rings.RingCount(), 2u);
  const std::size_t hole = rings.outer_of[0] == kNoRing ? 1 : 0;
  EXPECT_NEAR(rings.measures[hole].area, -5.3 * 4.1, 1e-12);
  EXPECT_NEAR(rings.measures[hole].perimeter, 18.8, 1e-12);
}

// The lines of a tank need not be one wall.
TEST(Walls, CornersBetweenWallsAreSharp) {
  ReconstructionParameters parameters = kTank;
  parameters.walls = {{{0, 30, 0, 0}}, {{-7, 0, 50, 0}}, {{20, 1, 20, 2}}};
  const Rings rings = ReconstructOnce(parameters, Column()).rings;
  const Rings others = ReconstructOnce(kTank, Column()).rings;
  EXPECT_LT(FarthestOf(rings, others), 1e-12);
  EXPECT_EQ(rings.wetted, others.wetted);
}

TEST(Walls, FluidAboveAWallDoesNotTouchIt) {
  ReconstructionParameters parameters{.spacing = 1.0};
  const Particles disc = support::Disc(8);
  const Rings free = ReconstructOnce(parameters, disc).rings;
  parameters.walls = {{{-10, -9.3, 10, -9.3}}};
  const Rings rings = ReconstructOnce(parameters, disc).rings;
  EXPECT_EQ(rings.points, free.points);
  EXPECT_TRUE(rings.wetted.empty());
  EXPECT_TRUE(rings.contacts.empty());
}

// Also in frames whose rings need repair.
TEST(Walls, FarWallsKeepTheBits) {
  for (std::uint64_t seed = 1; seed <= support::Tries(200u); ++seed) {
    const Particles particles = support::RandomScene(seed);
    double low = 0;
    for (std::size_t k = 0; k < particles.size(); ++k) low = std::min(low, particles.y(k));
    ReconstructionParameters parameters{.spacing = 1.0};
    const Rings free = ReconstructOnce(parameters, particles).rings;
    parameters.walls = {{{-10, low - 50, 10, low - 50}}};
    EXPECT_EQ(ReconstructOnce(parameters, particles).rings, free) << "seed " << seed;
  }
}

TEST(Walls, ResultsKeepTheGuaranteesInRandomFrames) {
  std::size_t wetted = 0, off = 0, contacts = 0, beyond = 0, points = 0;
  double farthest = 0, deepest = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(2'000u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const Particles particles = support::RandomScene(seed);
    ReconstructionParameters parameters{.fill = AllFills()[seed % AllFills().size()],
                                        .spacing = 1.0,
                                        .walls = support::RandomWalls(random, particles)};
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.4, 1.5);
    if (random.Chance(.2)) parameters.clean = false;
    const Result result = ReconstructOnce(parameters, particles);
    const absl::Status status = Validate(result, parameters.fill);
    ASSERT_TRUE(status.ok()) << status;
    const Rings& rings = result.rings;
    ASSERT_EQ(rings.contacts.size(), rings.contact_angles.size());
    for (const float angle : rings.contact_angles) {
      EXPECT_GE(angle, 0);
      EXPECT_LE(angle, std::numbers::pi_v<float>);
    }
    wetted += rings.wetted.size();
    contacts += rings.contacts.size();
    points += rings.PointCount();
    // The sign of a flat ring's area would be rounding.
    for (const RingMeasures& of : rings.measures) EXPECT_GT(std::abs(of.area), 1e-6);
    for (const std::uint32_t k : rings.wetted) {
      for (const std::size_t end : {std::size_t{k}, NextOf(rings, k)}) {
        const double height = Height(parameters.walls, X(rings, end), Y(rings, end));
        off += std::abs(height) > 1e-6;
        farthest = std::max(farthest, std::abs(height));
      }
    }
    for (std::size_t k = 0; k < rings.PointCount(); ++k) {
      const double height = Height(parameters.walls, X(rings, k), Y(rings, k));
      beyond += height < -1e-6;
      deepest = std::max(deepest, -height);
    }
  }
  std::printf(
      "%zu points, %zu wetted, %zu ends up to %.2f off their wall, %zu points up to %.2f beyond, "
      "%zu contacts\n",
      points, wetted, off, farthest, beyond, deepest, contacts);
  EXPECT_GT(contacts, support::Tries(1'000u));
  // The repair moves few points off their walls.
  EXPECT_LT(off, wetted / 50);
  EXPECT_LE(beyond, points / 100'000);
}

// Stripes of particles are walls, in frames whose spacing may be unknown.
TEST(Walls, ResultsKeepTheGuaranteesWithRandomWallParticles) {
  std::size_t contacts = 0, wetted = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(1'000u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    Particles particles = support::RandomScene(seed);
    const double angle = random.Uniform(0, 7), width = random.Uniform(3, 30);
    const double shift = random.Uniform(0, width), share = random.Uniform(0, .7);
    for (std::size_t k = 0; k < particles.size(); ++k) {
      const double at = particles.x(k) * std::cos(angle) + particles.y(k) * std::sin(angle) + shift;
      particles.phases.push_back(at / width - std::floor(at / width) < share ? 3 : 1);
    }
    ReconstructionParameters parameters{.fill = AllFills()[seed % AllFills().size()],
                                        .wall_phases = {7, 3}};
    if (random.Chance(.7)) parameters.spacing = 1;
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.4, 1.5);
    if (random.Chance(.3)) parameters.walls = support::RandomWalls(random, particles);
    const Result result = ReconstructOnce(parameters, particles);
    const absl::Status status = Validate(result, parameters.fill);
    ASSERT_TRUE(status.ok()) << status;
    contacts += result.rings.contacts.size();
    wetted += result.rings.wetted.size();
  }
  std::printf("%zu wetted, %zu contacts\n", wetted, contacts);
  EXPECT_GT(contacts, support::Tries(1'000u));
}

// The sides and corners of obstacles and tanks lie on nodes and rows of the lattice.
TEST(Walls, LinesAndCornersOnTheLatticeAreExact) {
  for (const double x : {5.0, 5.5, 6.0}) {
    for (const double y : {3.0, 3.5, 4.0}) {
      SCOPED_TRACE(testing::Message() << x << ", " << y);
      const Wall square{{x, y, x, y + 5, x + 7, y + 5, x + 7, y}};
      const Rings rings = ColumnAround(square);
      ASSERT_EQ(rings.RingCount(), 2u);
      const std::size_t hole = rings.outer_of[0] == kNoRing ? 1 : 0;
      EXPECT_EQ(rings.measures[hole].area, -35);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_TRUE(HasPoint(rings, square.points[2 * k], square.points[2 * k + 1])) << k;
      }
    }
  }
}

// Corners of turned tanks and obstacles, of one wall or of several, also in cells whose nodes are
// all outside.
TEST(Walls, CornersOfTurnedPolygonsAreVertices) {
  Random random(71);
  int missed = 0;
  for (int tank = 0; tank < support::Tries(300); ++tank) {
    SCOPED_TRACE(tank);
    const int corners = 4 + tank % 4;
    const double x = random.Uniform(-9, 9), y = random.Uniform(-9, 9);
    const double radius = random.Uniform(12, 20), turn = random.Uniform(0, 7);
    const Wall around = PolygonWall(x, y, radius, corners, turn, true);
    const double size = random.Uniform(2.5, 4);
    const Wall obstacle = PolygonWall(x, y, size, 3 + tank % 3, random.Uniform(0, 7), false);
    Particles particles;
    // Denser than the spacing, so that the fluid reaches into the corners.
    for (int k = 0; k < 90 * 90; ++k) {
      const double px = x + (k % 90 - 45) * .5, py = y + (k / 90 - 45) * .5;
      if (Height({around, obstacle}, px, py) > .2) particles.Add(px, py);
    }
    ReconstructionParameters parameters{.spacing = 1.0, .walls = {around, obstacle}};
    if (tank % 4 == 0) {  // The sides as endless lines.
      parameters.walls = {obstacle};
      for (std::size_t k = 0; k < around.points.size(); k += 2) {
        const std::size_t next = (k + 2) % around.points.size();
        parameters.walls.push_back({{around.points[k], around.points[k + 1], around.points[next],
                                     around.points[next + 1]}});
      }
    }
    const Result result = ReconstructOnce(parameters, particles);
    const absl::Status status = Validate(result);
    ASSERT_TRUE(status.ok()) << status;
    for (const Wall& wall : {around, obstacle}) {
      for (std::size_t k = 0; k < wall.points.size(); k += 2) {
        double nearest = 1e300;
        for (std::size_t p = 0; p < result.rings.PointCount(); ++p) {
          nearest = std::min(nearest, std::hypot(X(result.rings, p) - wall.points[k],
                                                 Y(result.rings, p) - wall.points[k + 1]));
        }
        missed += nearest > 1e-9;
      }
    }
  }
  EXPECT_EQ(missed, 0);
}

// Walls that reach far beyond the particles, or lie far from them.
TEST(Walls, FarPointsOfWallsDoNotMatter) {
  const Rings expected = ReconstructOnce(kTank, Column()).rings;
  for (const double far : {1e4, 1e7, 1e12, 1e20, 9e59}) {
    SCOPED_TRACE(far);
    ReconstructionParameters parameters = kTank;
    const auto distance = [&] {
      return FarthestOf(ReconstructOnce(parameters, Column()).rings, expected);
    };
    parameters.walls = {{{0, far, 0, 0, 20, 0, 20, far}}};
    EXPECT_LT(distance(), 1e-12);
    parameters.walls = {{{0, far, 0, -far}}, {{-far, 0, far, 0}}, {{20, -far, 20, far}}};
    EXPECT_LT(distance(), 1e-12);
    parameters.walls = {kTank.walls[0], {{far, 0, far, 10, far * 1.1, 0}}};
    EXPECT_LT(distance(), 1e-12);
    parameters.walls = {{{-far, 0, far, 0, far, 10, -far, 10}}, kTank.walls[0]};
    EXPECT_EQ(ReconstructOnce(parameters, Column()).statistics.area, 200);
    // A high tank and a high block, of whose sides rows of tiles see no more than the crossings.
    const Particles high = support::Lattice(20, 150, .5, .5);
    parameters.walls = {{{-far, 0, far, 0, far, 200, -far, 200}}};
    EXPECT_NEAR(ReconstructOnce(parameters, high).statistics.area, 3000, 10);
    parameters.walls = {{{-far, 0, -far, 200, 10, 200, 10, 0}}};
    EXPECT_NEAR(ReconstructOnce(parameters, high).statistics.area, 1500, 10);
  }
}

// Neighbouring points of a wall that the lattice cannot tell apart are one.
TEST(Walls, PointsThatRoundToOneAreOne) {
  ReconstructionParameters parameters{.spacing = 1.2};
  const double next = std::nextafter(5.0, 6.0);
  parameters.walls = {{{5, 5, next, 5, next, next, 9, 9, 5, 12}},
                      {{3, 3, std::nextafter(3.0, 4.0), 3}}};
  const Result result = ReconstructOnce(parameters, support::Disc(20));
  const absl::Status status = Validate(result);
  EXPECT_TRUE(status.ok()) << status;
  for (const double at : result.rings.points) EXPECT_TRUE(std::isfinite(at));
  EXPECT_FALSE(result.rings.wetted.empty());
}

TEST(Walls, ParticlesOfWallsAreNoFluid) {
  Particles particles = support::Lattice(26, 17, -2.5, -1.5);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const bool is_wall = particles.x(k) < 0 || particles.x(k) > 20 || particles.y(k) < 0;
    particles.phases.push_back(is_wall ? 2 : 1);
  }
  ReconstructionParameters parameters{.spacing = 1.0, .wall_phases = {2}};
  const Result result = ReconstructOnce(parameters, particles);
  EXPECT_EQ(result.statistics.particles, 300u);
  EXPECT_NEAR(result.statistics.area, 300, 3);
  EXPECT_EQ(result.rings.contacts.size(), 2u);
  EXPECT_TRUE(result.attributes.empty());
  // Without a spacing, the fluid shows it.
  parameters.spacing.reset();
  EXPECT_NEAR(ReconstructOnce(parameters, particles).statistics.area, 300, 3);
  // All are walls, or none.
  particles.phases.assign(particles.size(), 2);
  EXPECT_EQ(ReconstructOnce(parameters, particles).rings.RingCount(), 0u);
  particles.phases.assign(particles.size(), 1);
  const Rings body = ReconstructOnce(parameters, particles).rings;
  EXPECT_TRUE(body.wetted.empty());
  particles.phases.clear();
  EXPECT_EQ(body.points, ReconstructOnce({}, particles).rings.points);
  EXPECT_EQ(support::RefusalOf(parameters, particles)->reason, kReasonNoSuchAttribute);
}

TEST(Walls, CoarsePositionsOfFluidAndWallsAreRefused) {
  std::vector<float> xy, phases;
  for (int k = 0; k < 400; ++k) {
    xy.push_back(1e8F + 10.0F * static_cast<float>(k % 20));
    xy.push_back(10.0F * static_cast<float>(k / 20));
    phases.push_back(k < 60 ? 2 : 1);
  }
  const Attribute phase{"phase", 1, phases};
  const Frame frame{.positions = std::span<const float>(xy), .attributes = {&phase, 1}};
  const auto reconstructor = Reconstructor::Create({.spacing = 10.0, .wall_phases = {2}});
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, result);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange) << status;
}

TEST(Walls, DistantFluidAndWallsAreNamedByTheGivenIndex) {
  Particles particles = support::Lattice(26, 17, -2.5, -1.5);
  for (std::size_t k = 0; k < particles.size(); ++k) particles.phases.push_back(k % 2 ? 2 : 1);
  const ReconstructionParameters parameters{.spacing = 1.0, .wall_phases = {2}};
  for (const std::size_t distant : {301u, 200u}) {
    particles.xy[2 * distant + 1] = -2e9;
    const auto violation = support::RefusalOf(parameters, particles);
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->field, "positions[" + std::to_string(distant) + "].y");
    EXPECT_EQ(violation->value, "-2e+09");
  }
}

TEST(Walls, AnyNumberOfThreadsAndAnyInstructionSetGivesTheSameBits) {
  for (const std::uint64_t seed : {3u, 8u, 21u}) {
    Random random(seed);
    const Particles particles = support::Blob(random, 40);
    ReconstructionParameters parameters{.spacing = 1.0,
                                        .walls = support::RandomWalls(random, particles)};
    const Result expected = ReconstructOnce(parameters, particles);
    ASSERT_FALSE(expected.rings.wetted.empty());
    for (const std::size_t threads : {1u, 2u, 7u}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_EQ(ReconstructOnce(parameters, particles), expected);
    }
    support::ForEachInstructionSet(
        [&] { EXPECT_EQ(ReconstructOnce(parameters, particles), expected); });
  }
}

TEST(Walls, AFrameInTheSolidHasNoOutline) {
  const Wall wall{{-100, -100, -100, 100, 100, 100, 100, -100}};
  const Result result = ReconstructOnce({.spacing = 1.0, .walls = {wall}}, Column());
  EXPECT_EQ(result.rings.RingCount(), 0u);
}

TEST(Walls, BrokenRulesAreNamed) {
  struct Case {
    ReconstructionParameters parameters;
    std::string field, rule;
  };
  const Wall floor{{0, 0, 1, 0}};
  const double nan = std::nan("");
  const auto with = [](Wall wall) {
    return ReconstructionParameters{.spacing = 1.0, .walls = {std::move(wall)}};
  };
  std::vector<Case> cases = {
      {with({{}}), "walls[0].points", "two coordinates of at least two points"},
      {with({{0, 0, 1}}), "walls[0].points", "two coordinates of at least two points"},
      {with({{0, 0, 1, nan}}), "walls[0].points[3]", "in magnitude"},
      {with({{0, 0, 1e61, 0}}), "walls[0].points[2]", "in magnitude"},
      {with({{0, 0, 1e-61, 0}}), "walls[0].points[2]", "in magnitude"},
      {with({{1, 1, 1, 1}}), "walls[0].points", "must differ"},
      {with({{0, 0, 1, 1, 0, 0}}), "walls[0].points", "must differ"},
      {with({{0, 0, 2, 0, 1, 0}}), "walls[0].points", "does not touch itself"},
      {with({{0, 0, 2, 2, 2, 0, 0, 2}}), "walls[0].points", "does not touch itself"},
      {with({std::vector<double>(2 * 1025, 1.0)}), "walls", "at most 1024"},
  };
  ReconstructionParameters of = with(floor);
  of.placement = Placement::kQef;
  cases.push_back({of, "walls", "placement is virtual-plane"});
  of = with(floor);
  of.sizes = Sizes::kOwn;
  of.boundary = Boundary::kGrains;
  cases.push_back({of, "walls", "boundary is grains"});
  of = with(floor);
  of.isovalue = .5;
  cases.push_back({of, "walls", "isovalue"});
  of = with(floor);
  of.sections = {{.phase = 1}, {.isovalue = .5}};
  cases.push_back({of, "walls", "sections"});
  of = {.spacing = 1.0, .sections = {{.phase = 2}}, .wall_phases = {1, 2}};
  cases.push_back({of, "wall_phases[1]", "differ from sections[0].phase"});
  of = with(floor);
  of.slice = SlicePlane{};
  cases.push_back({of, "walls", "slice"});
  of = with(floor);
  of.output = Output::kSurface;
  cases.push_back({of, "walls", "surface"});
  of = {.spacing = 1.0, .wall_phases = {1, 2, 1}};
  cases.push_back({of, "wall_phases[2]", "differ from wall_phases[0]"});
  of.wall_phases = {1 << 25};
  cases.push_back({of, "wall_phases[0]", "2^24"});
  of.wall_phases = std::vector<std::int32_t>(17, 1);
  cases.push_back({of, "wall_phases", "at most 16"});
  of.wall_phases = {1};
  of.phase_attribute = "";
  cases.push_back({of, "phase_attribute", "printable"});
  of.phase_attribute = "phase";
  of.noise_filter = .5;
  cases.push_back({of, "wall_phases", "noise filter"});
  for (const Case& broken : cases) {
    SCOPED_TRACE(broken.field + ", " + broken.rule);
    const absl::Status status = Validate(broken.parameters);
    ASSERT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    const auto violation = FindViolation(status);
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->field, "parameters." + broken.field);
    EXPECT_NE(violation->rule.find(broken.rule), std::string::npos) << violation->rule;
  }
}

}  // namespace
}  // namespace partiemc
