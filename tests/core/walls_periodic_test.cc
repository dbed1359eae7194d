// Walls in periodic boxes: a body at a wall has the same outline across a face and in the middle of
// the box, and every result keeps its guarantees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::Particles;
using support::PolygonWall;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;

constexpr double kChannelLength = 48;

// A box that is periodic along x only.
PeriodicBox Channel(double origin = 0, double length = kChannelLength) {
  return {.axes = {PeriodicAxis{origin, length}, std::nullopt, std::nullopt}};
}

ReconstructionParameters InChannel(const PeriodicBox& box, std::vector<Wall> walls) {
  return {.spacing = 1.0, .box = box, .walls = std::move(walls)};
}

const Wall kBottom{{0, 0, 1, 0}};

// Fluid on the bottom, below a wave.
const Particles& WaveOnBottom() {
  static const Particles wave = [] {
    Random random(4);
    Particles particles;
    for (double y = .5; y < 20; ++y) {
      for (double x = .5; x < kChannelLength; ++x) {
        if (y > 9 + 3 * std::sin(2 * M_PI * x / kChannelLength)) continue;
        const double dx = random.Uniform(-.1, .1);
        particles.Add(x + dx, y + random.Uniform(-.1, .1));
      }
    }
    return particles;
  }();
  return wave;
}

// A half of a disc on the bottom.
Particles HalfDisc(double radius) {
  Particles half;
  const Particles disc = support::Disc(radius, .3, -.5);
  for (std::size_t k = 0; k < disc.size(); ++k) {
    if (disc.y(k) > 0) half.Add(disc.x(k), disc.y(k));
  }
  return half;
}

double WettedLength(const Rings& rings) {
  double length = 0;
  for (const std::uint32_t k : rings.wetted) {
    const auto ring = std::ranges::upper_bound(rings.offsets, k) - rings.offsets.begin() - 1;
    const std::size_t next = k + 1 < rings.offsets[ring + 1] ? k + 1 : rings.offsets[ring];
    length += std::hypot(rings.points[2 * next] - rings.points[2 * k],
                         rings.points[2 * next + 1] - rings.points[2 * k + 1]);
  }
  return length;
}

double LowestOf(const Rings& rings) {
  double lowest = 1e300;
  for (std::size_t k = 1; k < rings.points.size(); k += 2) {
    lowest = std::min(lowest, rings.points[k]);
  }
  return lowest;
}

TEST(WallsPeriodic, ALayerOnABottomIsCutAnywhere) {
  const auto area = static_cast<double>(WaveOnBottom().size());
  std::optional<double> perimeter;
  double area_error = 0, perimeter_error = 0;
  for (const bool wraps : {false, true}) {
    for (const double origin : {0., 7., 20.5, -31.25}) {
      SCOPED_TRACE(testing::Message() << "origin " << origin << ", wraps " << wraps);
      PeriodicBox box = Channel(origin);
      box.wraps = wraps;
      const Result result =
          ReconstructOnce(InChannel(box, {kBottom}), Wrapped(WaveOnBottom(), box));
      ExpectValid(result, Fill::kGreedy);
      ASSERT_EQ(result.rings.RingCount(), 1u);
      EXPECT_EQ(result.rings.cuts.size(), 2u);
      EXPECT_TRUE(result.rings.contacts.empty());
      EXPECT_EQ(LowestOf(result.rings), 0);
      EXPECT_NEAR(WettedLength(result.rings), kChannelLength, 1e-6);
      EXPECT_EQ(ParticlesOf(result.rings), WaveOnBottom().size());
      if (!perimeter) perimeter = result.statistics.perimeter;
      area_error = std::max(area_error, std::abs(result.statistics.area / area - 1));
      perimeter_error =
          std::max(perimeter_error, std::abs(result.statistics.perimeter / *perimeter - 1));
    }
  }
  std::printf("layer: area off by %.1e, perimeter by %.1e\n", area_error, perimeter_error);
  EXPECT_LT(area_error, 1e-6);
  EXPECT_LT(perimeter_error, 1e-4);
}

TEST(WallsPeriodic, ADropAcrossAFaceIsTheDropInTheMiddle) {
  const Particles drop = HalfDisc(9);
  const PeriodicBox box = Channel();
  std::optional<Result> middle;
  for (const double x : {24., 0., 47., 5.}) {
    SCOPED_TRACE(x);
    Result result =
        ReconstructOnce(InChannel(box, {kBottom}), Wrapped(support::Shifted(drop, x, 0), box));
    ExpectValid(result, Fill::kGreedy);
    ASSERT_EQ(result.rings.RingCount(), 1u);
    EXPECT_EQ(LowestOf(result.rings), 0);
    if (!middle) middle = std::move(result);
    if (x == 24) continue;
    EXPECT_NEAR(result.statistics.area, middle->statistics.area, 1e-6);
    EXPECT_NEAR(result.statistics.perimeter, middle->statistics.perimeter, 1e-6);
    ASSERT_EQ(result.rings.contacts.size(), 2u);
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(result.rings.contact_angles[k], middle->rings.contact_angles[k], 1e-5);
    }
  }
  PeriodicBox wraps = box;
  wraps.wraps = true;
  const Result pieces = ReconstructOnce(InChannel(wraps, {kBottom}), Wrapped(drop, wraps));
  ExpectValid(pieces, Fill::kGreedy);
  EXPECT_EQ(pieces.rings.RingCount(), 2u);
  EXPECT_EQ(pieces.rings.contacts.size(), 2u);
  EXPECT_NEAR(pieces.statistics.area, middle->statistics.area, 1e-6 * middle->statistics.area);
  EXPECT_NEAR(WettedLength(pieces.rings), WettedLength(middle->rings), 1e-4);
}

// A whole drop beside a layer that is cut: the marks of its points stay with their points.
TEST(WallsPeriodic, DropsBesideALayerKeepTheirContacts) {
  const Wall top{{1, 40, 0, 40}};
  const PeriodicBox box = Channel();
  std::optional<double> wetted;
  for (const double x : {24., 0., 46.}) {
    SCOPED_TRACE(x);
    Particles scene = WaveOnBottom();
    const Particles drop = HalfDisc(7);
    for (std::size_t k = 0; k < drop.size(); ++k) scene.Add(x + drop.x(k), 40 - drop.y(k));
    const Result result =
        ReconstructOnce(InChannel(box, {kBottom, top}), Wrapped(std::move(scene), box));
    ExpectValid(result, Fill::kGreedy);
    ASSERT_EQ(result.rings.RingCount(), 2u);
    ASSERT_EQ(result.rings.contacts.size(), 2u);
    for (const std::uint32_t contact : result.rings.contacts) {
      EXPECT_NEAR(result.rings.points[2 * contact + 1], 40, 1e-9);
    }
    if (!wetted) wetted = WettedLength(result.rings);
    EXPECT_NEAR(WettedLength(result.rings), *wetted, 1e-5);
    EXPECT_NEAR(*wetted, kChannelLength + 14, .5);
  }
}

// A full channel with a square obstacle. Across a face it becomes a notch at both faces.
TEST(WallsPeriodic, ObstaclesHaveImages) {
  const Wall top{{1, 30, 0, 30}};
  const PeriodicBox box = Channel();
  for (const double x : {20., 0., 45., 48 + 20., -48 - 5.}) {
    SCOPED_TRACE(x);
    const Wall square{{x, 10, x, 20, x + 10, 20, x + 10, 10}};
    Particles fluid;
    for (double py = .5; py < 30; ++py) {
      for (double px = .5; px < kChannelLength; ++px) {
        const double from = px - x - kChannelLength * std::floor((px - x) / kChannelLength);
        if (py < 10 || py > 20 || from > 10) fluid.Add(px, py);
      }
    }
    const Result result = ReconstructOnce(InChannel(box, {kBottom, top, square}), fluid);
    ExpectValid(result, Fill::kGreedy);
    EXPECT_NEAR(result.statistics.area, 30 * kChannelLength - 100, 1e-6);
    EXPECT_NEAR(WettedLength(result.rings), 2 * kChannelLength + 40, 1e-6);
    // At x = 0 the side of the obstacle lies on the face.
    const bool is_across = std::abs(std::remainder(x, kChannelLength)) < 10;
    if (is_across && x != 0) {
      EXPECT_EQ(result.rings.RingCount(), 1u);
    }
  }
}

// Two layers of particles are the bottom. The outline of the fluid is the same wherever the faces
// are, and as high above the bottom as at a line.
TEST(WallsPeriodic, ParticlesAreWallsAcrossTheFaces) {
  Particles scene = WaveOnBottom();
  scene.phases.assign(scene.size(), 1);
  for (double x = .5; x < kChannelLength; ++x) {
    for (const double y : {-.5, -1.5}) {
      scene.Add(x, y);
      scene.phases.push_back(2);
    }
  }
  std::optional<double> area;
  double area_error = 0;
  for (const bool wraps : {false, true}) {
    for (const double origin : {0., 20.5, -31.25}) {
      SCOPED_TRACE(testing::Message() << "origin " << origin << ", wraps " << wraps);
      PeriodicBox box = Channel(origin);
      box.wraps = wraps;
      ReconstructionParameters parameters = InChannel(box, {});
      parameters.wall_phases = {2};
      const Result result = ReconstructOnce(parameters, Wrapped(scene, box));
      ExpectValid(result, Fill::kGreedy);
      ASSERT_EQ(result.rings.RingCount(), 1u);
      EXPECT_NEAR(LowestOf(result.rings), 0, .15);
      EXPECT_NEAR(WettedLength(result.rings), kChannelLength, .5);
      if (!area) area = result.statistics.area;
      area_error = std::max(area_error, std::abs(result.statistics.area / *area - 1));
      EXPECT_EQ(ParticlesOf(result.rings), WaveOnBottom().size());
    }
  }
  std::printf("layer on particles: area differs by %.1e\n", area_error);
  EXPECT_LT(area_error, 1e-5);
}

TEST(WallsPeriodic, BodiesKeepIdentitiesWhileTheyCross) {
  for (const bool wraps : {false, true}) {
    PeriodicBox box = Channel();
    box.wraps = wraps;
    RingStream stream(InChannel(box, {kBottom, {{1, 40, 0, 40}}}));
    std::vector<std::uint64_t> first;
    for (int step = 0; step < 100; ++step) {
      SCOPED_TRACE(testing::Message() << "wraps " << wraps << ", step " << step);
      Particles scene = support::Shifted(WaveOnBottom(), .9 * step, 0);
      const Particles drop = HalfDisc(6);
      for (std::size_t k = 0; k < drop.size(); ++k) {
        scene.Add(drop.x(k) - .7 * step, 40 - drop.y(k));
      }
      std::vector<std::uint64_t> identities;
      for (const RingMeasures& ring : stream.Next(Wrapped(std::move(scene), box)).measures) {
        if (ring.identity != 0) identities.push_back(ring.identity);
      }
      std::ranges::sort(identities);
      if (step == 0) first = identities;
      ASSERT_EQ(first.size(), 2u);
      ASSERT_EQ(identities, first);
    }
  }
}

TEST(WallsPeriodic, ResultsKeepTheGuaranteesInRandomFrames) {
  std::size_t cut = 0, contacts = 0, wetted = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(600u) && !HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const double length =
        random.Chance(.5) ? std::floor(random.Uniform(13, 40)) : random.Uniform(13, 40);
    const double height = random.Uniform(13, 30);
    PeriodicBox box = Channel(random.Uniform(-20, 20), length);
    if (random.Chance(.2)) box.axes[1] = PeriodicAxis{random.Uniform(-9, 9), height};
    box.wraps = random.Chance(.3);
    ReconstructionParameters parameters = InChannel(box, {});
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.3)) parameters.cell_size = random.Uniform(.4, 1.5);
    if (random.Chance(.2)) parameters.clean = false;
    if (random.Chance(.2)) parameters.min_component_particles = random.Below(9);
    const double density = random.Chance(.5) ? random.Uniform(.7, 1.2) : random.Uniform(.02, .7);
    Particles particles;
    const double filled = random.Uniform(2, height);
    for (double k = density * length * filled; k > 0; --k) {
      const double x = random.Uniform(0, length);
      particles.Add(x, random.Uniform(0, filled));
    }
    for (std::size_t k = random.Below(20); k > 0; --k) {
      const double x = random.Uniform(0, length);
      particles.Add(x, random.Uniform(0, height));
    }
    if (!box.axes[1]) {
      const double low = random.Chance(.3) ? 0 : random.Uniform(-2, 2);
      if (random.Chance(.8)) parameters.walls.push_back({{3, low, 4, low}});
      if (random.Chance(.3)) parameters.walls.push_back({{4, filled, 3, filled}});
    }
    for (std::size_t k = random.Below(3); k > 0; --k) {
      const double x = random.Uniform(-length, 2 * length), y = random.Uniform(0, filled);
      parameters.walls.push_back(PolygonWall(x, y, random.Uniform(.5, 7),
                                             3 + static_cast<int>(random.Below(20)),
                                             random.Uniform(0, 7), false));
    }
    if (random.Chance(.3)) {
      parameters.wall_phases = {2};
      const double share = random.Uniform(0, .3), width = random.Uniform(2, length);
      for (std::size_t k = 0; k < particles.size(); ++k) {
        const double at = random.Chance(.5) ? particles.x(k) / width : particles.y(k) / height;
        particles.phases.push_back(at - std::floor(at) < share ? 2 : 1);
      }
    }
    const Result result = ReconstructOnce(parameters, Wrapped(std::move(particles), box));
    ExpectValid(result, parameters.fill);
    ASSERT_EQ(result.rings.contacts.size(), result.rings.contact_angles.size());
    ASSERT_TRUE(std::ranges::is_sorted(result.rings.wetted));
    ASSERT_TRUE(result.rings.wetted.empty() ||
                result.rings.wetted.back() < result.rings.PointCount());
    std::vector<std::uint32_t> both;
    std::ranges::set_intersection(result.rings.cuts, result.rings.wetted, std::back_inserter(both));
    EXPECT_TRUE(both.empty());
    cut += result.rings.cuts.empty() ? 0 : 1;
    contacts += result.rings.contacts.size();
    wetted += result.rings.wetted.size();
  }
  std::printf("%zu frames cut, %zu contacts, %zu wetted\n", cut, contacts, wetted);
  EXPECT_GT(cut, support::Tries(600u) / 3);
  EXPECT_GT(contacts, support::Tries(600u));
}

TEST(WallsPeriodic, BitsDependNeitherOnThreadsNorOnOrder) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  const PeriodicBox box = Channel();
  const Wall obstacle = PolygonWall(1, 5, 3, 7, .2, false);
  ReconstructionParameters parameters = InChannel(box, {kBottom, obstacle});
  parameters.wall_phases = {2};
  Particles scene = WaveOnBottom();
  scene.phases.assign(scene.size(), 1);
  for (double x = .5; x < kChannelLength; ++x) {
    for (const double y : {22., 23.}) {
      scene.Add(x, y);
      scene.phases.push_back(2);
    }
  }
  const Result expected = ReconstructOnce(parameters, scene);
  ASSERT_FALSE(expected.rings.wetted.empty());
  ASSERT_FALSE(expected.rings.cuts.empty());
  Particles reversed;
  for (std::size_t k = scene.size(); k-- > 0;) {
    reversed.Add(scene.x(k), scene.y(k));
    reversed.phases.push_back(scene.phases[k]);
  }
  for (const unsigned threads : {1u, 2u, 7u}) {
    Arena(threads).Execute([&] {
      EXPECT_EQ(ReconstructOnce(parameters, scene), expected);
      const Rings rings = ReconstructOnce(parameters, reversed).rings;
      EXPECT_THAT(rings.points,
                  testing::Pointwise(testing::DoubleNear(1e-5), expected.rings.points));
      EXPECT_EQ(rings.wetted, expected.rings.wetted);
    });
  }
}

TEST(WallsPeriodic, ErrorsNameAWallOrAGivenParticle) {
  const PeriodicBox box = Channel();
  const auto refused = [&](const Wall& wall, const PeriodicBox& in) {
    const auto violation = FindViolation(Validate(InChannel(in, {kBottom, wall})));
    return violation ? violation->field + " " + violation->rule : "";
  };
  using testing::AllOf;
  using testing::HasSubstr;
  using testing::StartsWith;
  EXPECT_THAT(refused({{0, 0, 1, 1e-9}}, box),
              AllOf(StartsWith("parameters.walls[1].points"), HasSubstr("periodic axis")));
  EXPECT_THAT(refused({{0, 0, 9, 0, 9, 9}}, box), HasSubstr("clockwise obstacle"));
  EXPECT_EQ(refused({{9, 9, 9, 0, 0, 0}}, box), "");
  EXPECT_THAT(refused({{9, 9, 9, 0, 0, 0}}, BoxOf(50, 50)),
              AllOf(StartsWith("parameters.walls[0]"), HasSubstr("both axes")));
  // Obstacles far away, and obstacles with too many images.
  const auto in_frame = [&](const Wall& wall) {
    const auto violation = RefusalOf(InChannel(box, {wall}), WaveOnBottom());
    return violation ? violation->field + " " + violation->rule : "";
  };
  ReconstructOnce(InChannel(box, {PolygonWall(1e6, 5, 3, 5, 0, false)}), WaveOnBottom());
  EXPECT_THAT(in_frame(PolygonWall(1e9, 5, 3, 5, 0, false)),
              AllOf(StartsWith("parameters.walls[0].points"), HasSubstr("1e6 lengths")));
  // Beside the fluid along one axis, and at any distance along the other.
  ReconstructionParameters beside = InChannel(BoxOf(48, 48), {});
  beside.walls = {{{80, 1e20, 80, 1.1e20, 81, 1.1e20, 81, 1e20}}};
  ReconstructOnce(beside, support::Shifted(support::Disc(5), 20, 20));
  EXPECT_THAT(in_frame(PolygonWall(0, 5, 4e6, 5, 0, false)),
              AllOf(StartsWith("parameters.walls "), HasSubstr("65536 points")));
  // A fluid particle far from the box, after wall particles.
  Particles scene = WaveOnBottom();
  scene.phases.assign(scene.size(), 1);
  for (std::size_t k = 0; k < 9; ++k) scene.phases[k] = 2;
  scene.xy[2 * 20] = 1e8;
  ReconstructionParameters parameters = InChannel(box, {});
  parameters.wall_phases = {2};
  auto violation = RefusalOf(parameters, scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "positions[20].x");
  // The lifted fluid is beyond the lattice, and so are the images of the walls.
  scene.xy[2 * 20] = 3;
  parameters.box = Channel(3e9, 4e4);
  std::swap(scene.phases[0], scene.phases[9]);
  violation = RefusalOf(parameters, scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "positions[1].x") << "the first particle of the walls";
  std::ranges::fill(scene.phases, 1.0f);
  scene.phases[0] = 2;
  scene.xy[1] = -1e6;  // Out of the range.
  violation = RefusalOf(parameters, scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "positions[1].x") << "the first particle of the fluid";
  scene.xy[1] = .5;
  // A wall particle far from the box, with the spacing known and unknown.
  parameters.box = box;
  scene.xy[0] = 1e8;
  violation = RefusalOf(parameters, scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "positions[0].x");
  EXPECT_THAT(violation->rule, HasSubstr("1e6 lengths"));
  Particles few;
  few.Add(5, 5);
  few.Add(1e19, 5);
  few.phases = {1, 2};
  parameters.spacing.reset();
  EXPECT_EQ(ReconstructOnce(parameters, few).rings.RingCount(), 0u);
}

// A thin obstacle far from the origin, whose images round to lines.
TEST(WallsPeriodic, RoundedImagesOfObstaclesStayObstacles) {
  const PeriodicBox box = Channel(1e7, 100);
  const Particles block = support::Lattice(12, 12, 1e7 + 40.5, 40.5);
  for (const double width : {1e-2, 1e-10}) {
    const Wall thin{{46, 44, 46, 47, 46 + width, 47, 46 + width, 44}};
    EXPECT_NEAR(ReconstructOnce(InChannel(box, {thin}), block).statistics.area, 144, 1) << width;
  }
}

// The plane of the particles decides which axis of the box is which.
TEST(WallsPeriodic, FramesInOtherPlanesHaveTheSameOutlines) {
  const Result expected = ReconstructOnce(InChannel(Channel(), {kBottom}), WaveOnBottom());
  std::vector<double> xyz;
  for (std::size_t k = 0; k < WaveOnBottom().size(); ++k) {
    xyz.insert(xyz.end(), {7, WaveOnBottom().x(k), WaveOnBottom().y(k)});
  }
  const Frame in_space{.positions = std::span<const double>(xyz), .components = 3};
  ReconstructionParameters parameters = InChannel({}, {kBottom});
  parameters.plane = Plane::kYz;
  parameters.box->axes = {std::nullopt, PeriodicAxis{0, kChannelLength}, std::nullopt};
  EXPECT_EQ(ReconstructOnce(parameters, in_space).rings, expected.rings);
  // Across the periodic axis, here of frames with x and y.
  parameters.plane = Plane::kXz;
  const auto violation = RefusalOf(parameters, WaveOnBottom());
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "parameters.walls[0].points");
}

// The box grows, with an obstacle and wall particles, and positions are filtered.
TEST(WallsPeriodic, BoxesOfFramesAndTheNoiseFilterApply) {
  for (const bool are_particles : {false, true}) {
    ReconstructionParameters parameters = InChannel(Channel(), {});
    parameters.walls = {PolygonWall(24, 4, 2.5, 12, .1, false)};
    if (are_particles) {
      parameters.wall_phases = {2};
    } else {
      parameters.walls.push_back(kBottom);
      parameters.noise_filter = .5;
    }
    RingStream stream(parameters);
    for (int step = 0; step < 6; ++step) {
      SCOPED_TRACE(testing::Message() << are_particles << " " << step);
      const double stretch = 1 + .01 * step, length = kChannelLength * stretch;
      Particles scene = WaveOnBottom();
      scene.phases.assign(scene.size(), 1);
      scene.Add(support::Lattice(48, 2, .5, -1.5));
      scene.phases.resize(scene.size(), 2);
      for (std::size_t k = 0; k < scene.size(); ++k) {
        scene.xy[2 * k] *= stretch;
        scene.ids.push_back(k);
      }
      Particles fluid;
      for (std::size_t k = 0; k < scene.size(); ++k) {
        const bool is_covered = std::hypot(scene.x(k) - 24, scene.y(k) - 4) < 3;
        if (is_covered || (!are_particles && scene.phases[k] == 2)) continue;
        fluid.Add(scene.x(k), scene.y(k));
        fluid.phases.push_back(scene.phases[k]);
        fluid.ids.push_back(scene.ids[k]);
      }
      Frame frame = fluid.AsFrame();
      frame.box = Channel(0, length);
      const Rings& rings = stream.Next(frame);
      ExpectValid(stream.result(), Fill::kGreedy);
      ASSERT_EQ(rings.RingCount(), 2u);
      // The bottom, and most of the obstacle, which has 15.5.
      EXPECT_GT(WettedLength(rings), length + 8);
      EXPECT_LT(WettedLength(rings), length + 16);
    }
  }
}

}  // namespace
}  // namespace partiemc
