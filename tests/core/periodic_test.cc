// Periodic boxes: outlines are those of the same bodies in the middle of the box.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "base/cancellation.h"
#include "core/boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "periodic/image_sets.h"
#include "periodic/lift.h"
#include "periodic/run_periods.h"
#include "support/numbers.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tracked_scene.h"

namespace partiemc {
namespace {

using support::kInfinity;
using support::kNan;
using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;
using testing::ElementsAre;
using testing::IsEmpty;

// Area and perimeter of each outer ring, ascending.
std::vector<std::pair<double, double>> SizesOf(const Rings& rings) {
  std::vector<std::pair<double, double>> sizes;
  for (const RingMeasures& ring : rings.measures) sizes.emplace_back(ring.area, ring.perimeter);
  std::ranges::sort(sizes);
  return sizes;
}

void ExpectSameSizes(const Rings& rings, const Rings& expected, double tolerance) {
  const auto sizes = SizesOf(rings), wanted = SizesOf(expected);
  ASSERT_EQ(sizes.size(), wanted.size());
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    EXPECT_NEAR(sizes[k].first, wanted[k].first, tolerance * std::abs(wanted[k].first));
    EXPECT_NEAR(sizes[k].second, wanted[k].second, tolerance * wanted[k].second);
  }
}

TEST(Periodic, DiscAcrossEdgeAndCornerIsTheDiscInTheMiddle) {
  const PeriodicBox box = BoxOf(40, 32);
  // The lattice is the same for all, because the shifts are whole spacings.
  const Result middle = ReconstructOnce({.spacing = 1.0}, support::Disc(8, 20, 16));
  ASSERT_EQ(middle.rings.RingCount(), 1u);
  for (const auto& [x, y] : {std::pair(0, 16), {20, 0}, {0, 0}, {39, 31}, {37, 3}}) {
    SCOPED_TRACE(x);
    const Particles disc = Wrapped(support::Disc(8, x, y), box);
    const Result across = ReconstructOnce(In(box), disc);
    ASSERT_EQ(across.rings.RingCount(), 1u);
    ExpectSameSizes(across.rings, middle.rings, 1e-8);
    EXPECT_EQ(across.rings.measures[0].particle_count, middle.rings.measures[0].particle_count);
    EXPECT_NEAR(across.rings.measures[0].centroid_x, x, 1e-6);
    EXPECT_NEAR(across.rings.measures[0].centroid_y, y, 1e-6);
    EXPECT_TRUE(Validate(across, Fill::kGreedy).ok());
    // The frame was cut by the edge: without the box it has more rings.
    EXPECT_GT(ReconstructOnce({.spacing = 1.0}, disc).rings.RingCount(), 1u);
  }
}

TEST(Periodic, BodyInTheMiddleKeepsItsBits) {
  Random random(5);
  Particles blob = support::Shifted(support::Blob(random, 9), 25.3, 24.1);
  const Result open = ReconstructOnce({.spacing = 1.0}, blob);
  EXPECT_EQ(ReconstructOnce(In(BoxOf(50, 50)), blob), open);
  // The same body, given in other images of the box.
  blob.xy[0] += 3 * 64;
  const Result images = ReconstructOnce(In(BoxOf(64, 64)), blob);
  ExpectSameSizes(images.rings, open.rings, 1e-9);
}

// Bodies far enough from each other, at random places of the box.
struct Scattered {
  Particles particles;
  std::vector<Particles> bodies;
};
Scattered Scatter(Random& random, double length) {
  Scattered all;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double radius = random.Uniform(1, 5);
      Particles body = support::Shifted(support::Blob(random, radius), (column + .5) * length / 3,
                                        (row + .5) * length / 3);
      all.particles.Add(body);
      all.bodies.push_back(std::move(body));
    }
  }
  return all;
}

// The rings of a frame in a box have the sizes of the rings without one, wherever the frame lies,
// up to rounding. Both lie the same in the lattice.
TEST(Periodic, ShiftModuloTheBoxMovesTheRings) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const PeriodicBox box = BoxOf(66, 66, -12, 7);
    const Scattered scene = Scatter(random, 66);
    const double dx = std::floor(random.Uniform(-200, 200));
    const double dy = std::floor(random.Uniform(-200, 200));
    for (const double cells : {0.0, .37, .61}) {
      const Particles apart = support::Shifted(scene.particles, cells, .5 * cells);
      const Result open = ReconstructOnce({.spacing = 1.0}, apart);
      const Result periodic =
          ReconstructOnce(In(box), Wrapped(support::Shifted(apart, dx, dy), box));
      // Sums of single precision have another order where the tiles lie differently.
      ExpectSameSizes(periodic.rings, open.rings, 1e-5);
      EXPECT_NEAR(periodic.statistics.perimeter, open.statistics.perimeter,
                  1e-6 * open.statistics.perimeter);
      EXPECT_TRUE(Validate(periodic, Fill::kGreedy).ok());
    }
  }
}

TEST(Periodic, ThreadsChangeNoBit) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 5);
  Random random(8);
  const PeriodicBox box = BoxOf(66, 66, 20, 20);
  const Particles particles = Wrapped(Scatter(random, 66).particles, box);
  Arena one(1);
  Result first;
  one.Execute([&] { first = ReconstructOnce(In(box), particles); });
  EXPECT_GT(first.rings.RingCount(), 5u);
  for (const unsigned threads : {2u, 5u}) {
    Arena arena(threads);
    arena.Execute([&] { EXPECT_EQ(ReconstructOnce(In(box), particles), first); });
  }
}

TEST(Periodic, OrderOfParticlesChangesNoLiftedPosition) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const PeriodicBox box = BoxOf(66.1, 66.3, 20, 20);
    const Particles particles = Wrapped(Scatter(random, 66).particles, box);
    const auto lift = [&](const Particles& given) {
      constexpr std::array kAxes = {0, 1};
      const Frame frame = given.AsFrame();
      LiftScratch scratch;
      LiftedFrame lifted;
      const absl::Status status = Lift({.frame = frame,
                                        .box = box,
                                        .axes = kAxes,
                                        .range = 6,
                                        .margin = 0,
                                        .reserve = [](std::uint64_t) { return absl::OkStatus(); }},
                                       scratch, lifted);
      EXPECT_TRUE(status.ok()) << status;
      std::vector<std::array<double, 4>> rows;  // Given and lifted positions.
      for (std::size_t k = 0; k < given.size(); ++k) {
        rows.push_back(
            {given.x(k), given.y(k), scratch.positions[2 * k], scratch.positions[2 * k + 1]});
      }
      std::ranges::sort(rows);
      return rows;
    };
    EXPECT_EQ(lift(support::Permuted(particles, random)), lift(particles));
  }
}

TEST(Periodic, OnePeriodicAxisLeavesTheOtherOpen) {
  PeriodicBox box = BoxOf(40, 40);
  box.axes[1].reset();
  const Result middle = ReconstructOnce({.spacing = 1.0}, support::Disc(8, 20, 100));
  const Result across = ReconstructOnce(In(box), Wrapped(support::Disc(8, 0, 100), box));
  ExpectSameSizes(across.rings, middle.rings, 1e-8);
  EXPECT_NEAR(across.rings.measures[0].centroid_y, 100, 1e-6);
}

TEST(Periodic, PlaneOfThreeComponentsHasItsAxes) {
  const Particles disc = support::Disc(8, 0, 16);
  std::vector<double> xyz;
  for (std::size_t k = 0; k < disc.size(); ++k) {
    const double x = disc.x(k);
    xyz.insert(xyz.end(), {x < 0 ? x + 40 : x, 3, disc.y(k)});
  }
  ReconstructionParameters parameters{.spacing = 1.0, .plane = Plane::kXz};
  parameters.box = PeriodicBox{.axes = {PeriodicAxis{0, 40}, std::nullopt, PeriodicAxis{0, 40}}};
  const Frame frame{.positions = std::span<const double>(xyz), .components = 3};
  const Result across = ReconstructOnce(parameters, frame);
  ASSERT_EQ(across.rings.RingCount(), 1u);
  ExpectSameSizes(across.rings, ReconstructOnce({.spacing = 1.0}, disc).rings, 1e-8);
  // y is no axis of this plane.
  parameters.box->axes[1] = PeriodicAxis{0, 40};
  State state;
  Workspace workspace;
  Result result;
  const auto violation = FindViolation(
      Reconstructor::Create(parameters)->Reconstruct(frame, state, workspace, result));
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "parameters.box.y");
}

TEST(Periodic, EstimatedSpacingIsThatOfTheOpenFrame) {
  const PeriodicBox box = BoxOf(40, 40);
  const Result middle = ReconstructOnce({}, support::Disc(8, 20, 20));
  const Result across = ReconstructOnce({.box = box}, Wrapped(support::Disc(8, 0, 0), box));
  ASSERT_EQ(across.rings.RingCount(), 1u);
  EXPECT_NEAR(across.statistics.spacing, middle.statistics.spacing, 1e-9);
  ExpectSameSizes(across.rings, middle.rings, 1e-6);
}

// Two bodies that cross the faces in opposite directions.
Particles Crossing(support::Known known, int frame) {
  Particles all;
  const auto add = [&](const Particles& body, std::uint64_t first_id, double vx, double vy) {
    for (std::size_t k = 0; k < body.size(); ++k) {
      all.Add(body.x(k), body.y(k));
      if (known.ids) all.ids.push_back(first_id + k);
      if (!known.velocities) continue;
      all.velocities.push_back(static_cast<float>(vx));
      all.velocities.push_back(static_cast<float>(vy));
    }
  };
  // An annulus, whose hole also has an identity.
  add(support::Shifted(support::Annulus(4, 9), 25 + 1.3 * frame, 20 - .7 * frame), 0, 1.3, -.7);
  add(support::Disc(4, 60 - 1.1 * frame, 52 - .7 * frame), 5000, -1.1, -.7);
  all.time = frame;
  return all;
}

class CrossingBodies : public testing::TestWithParam<support::Known> {};
INSTANTIATE_TEST_SUITE_P(With, CrossingBodies,
                         testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                         support::kBoth),
                         testing::PrintToStringParamName());

TEST_P(CrossingBodies, KeepTheirIdentitiesForHundredFrames) {
  // The length is not a whole number of cells.
  const PeriodicBox box = BoxOf(70.3, 66.7, 3, -8);
  RingStream stream(In(box));
  std::vector<std::uint64_t> first;
  std::set<std::pair<double, double>> images;
  for (int frame = 0; frame < 100; ++frame) {
    SCOPED_TRACE(frame);
    const Particles particles = Wrapped(Crossing(GetParam(), frame), box);
    const Rings& rings = stream.Next(particles);
    ASSERT_EQ(rings.RingCount(), 3u);
    std::vector<std::uint64_t> identities;
    for (std::size_t ring = 0; ring < 3; ++ring) {
      identities.push_back(rings.measures[ring].identity);
      if (frame > 0) {
        EXPECT_THAT(stream.rings().ParentsOf(ring), ElementsAre(rings.measures[ring].identity));
      }
      EXPECT_GE(rings.measures[ring].centroid_x, 3 - 1);
      EXPECT_LE(rings.measures[ring].centroid_x, 73.3 + 1);
    }
    std::ranges::sort(identities);
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
  }
}

// Two bodies that meet across a face become one, and part again.
TEST(Periodic, MergeAndSplitAcrossFaceHaveTheirParents) {
  const PeriodicBox box = BoxOf(60, 60);
  const auto scene = [&](double half_gap) {
    Particles all = support::Lattice(9, 9, half_gap, 20);
    all.Add(support::Lattice(12, 9, 60 - half_gap - 11, 20));
    return Wrapped(all, box);
  };
  RingStream stream(In(box));
  stream.Next(scene(4));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  stream.Next(scene(.5));
  ASSERT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_THAT(stream.Parents(0, 24), ElementsAre(1, 2));
  const std::uint64_t whole = stream.rings().measures[0].identity;
  stream.Next(scene(4));
  ASSERT_EQ(stream.rings().RingCount(), 2u);
  for (std::size_t ring = 0; ring < 2; ++ring) {
    EXPECT_THAT(stream.rings().ParentsOf(ring), ElementsAre(whole));
  }
}

// Rings of this placement may cross, so they cannot be cut at the faces.
ReconstructionParameters Uncut(const PeriodicBox& box) {
  ReconstructionParameters parameters = In(box);
  parameters.placement = Placement::kFarthestParticle;
  return parameters;
}

TEST(Periodic, BodyThatReachesItsOwnImageIsRefusedIfItCannotBeCut) {
  const PeriodicBox box = BoxOf(40, 60);
  const auto layer = RefusalOf(Uncut(box), support::Lattice(40, 8, 0, 20));
  ASSERT_TRUE(layer.has_value());
  EXPECT_EQ(layer->reason, kReasonPercolates);
  EXPECT_EQ(layer->field, "positions");
  EXPECT_EQ(layer->value, "a body percolates along x");
  const auto column = RefusalOf(Uncut(box), support::Lattice(8, 60, 20, 0));
  EXPECT_EQ(column->value, "a body percolates along y");
  const auto filled = RefusalOf(Uncut(box), support::Lattice(40, 60));
  EXPECT_EQ(filled->value, "a body percolates along x and y");
  // A diagonal band winds around both axes at once.
  Particles band;
  for (int k = 0; k < 120; ++k) band.Add(k / 3., k / 2.);
  EXPECT_EQ(RefusalOf(Uncut(box), Wrapped(band, box))->value, "a body percolates along x and y");
}

TEST(Periodic, RangeIsTwoKernelRadii) {
  const PeriodicBox box = BoxOf(40, 40);
  // The gap to the own image is 40 - 33 = 7, then 6.
  RingStream stream(Uncut(box));
  stream.Next(support::Lattice(34, 3, 5, 20));
  EXPECT_EQ(stream.rings().RingCount(), 1u);
  EXPECT_EQ(RefusalOf(Uncut(box), support::Lattice(35, 3, 5, 20))->reason, kReasonPercolates);
  // The bar does not touch its image, so it is whole if it may be cut.
  const Result bar = ReconstructOnce(In(box), support::Lattice(35, 3, 5, 20));
  EXPECT_EQ(bar.rings.RingCount(), 1u);
  EXPECT_EQ(bar.statistics.cut_bodies, 0u);
}

// A bar that is longer than the box does not wind around it if it is not closed.
TEST(Periodic, SpiralLongerThanTheBoxIsOneBody) {
  const PeriodicBox box = BoxOf(40, 40);
  Particles bar;
  for (int k = 0; k < 90; ++k) {
    for (int row = 0; row < 3; ++row) bar.Add(k, 5 + k / 4. + row);
  }
  const Result open = ReconstructOnce({.spacing = 1.0}, bar);
  const Result spiral = ReconstructOnce(In(box), Wrapped(bar, box));
  ASSERT_EQ(spiral.rings.RingCount(), 1u);
  ExpectSameSizes(spiral.rings, open.rings, 1e-6);
}

TEST(Periodic, RefusedFrameChangesNothing) {
  const PeriodicBox box = BoxOf(40, 40);
  RingStream stream(In(box));
  stream.Next(support::Disc(6, 0, 0));
  const State before = stream.state();
  Particles far = support::Disc(6, 0, 0);
  far.Add(20, 4.1e7);
  EXPECT_FALSE(stream.Try(far).ok());
  EXPECT_EQ(stream.state(), before);
  const std::uint64_t identity = before.history.rings[0].identity;
  EXPECT_EQ(stream.Next(support::Disc(6, 39, 39)).measures[0].identity, identity);
}

TEST(Periodic, WrongBoxesAreRefused) {
  const auto field_of = [](const PeriodicBox& box, std::optional<double> spacing = 1.0) {
    const absl::Status status = Validate(ReconstructionParameters{.spacing = spacing, .box = box});
    const auto violation = FindViolation(status);
    return violation ? violation->field : status.ToString();
  };
  for (const double length : {0.0, -40.0, kNan, kInfinity, -kInfinity, 1e70, 11.99, 1.1e8}) {
    EXPECT_EQ(field_of(BoxOf(length, 40)), "parameters.box.x.length") << length;
    EXPECT_EQ(field_of(BoxOf(40, length)), "parameters.box.y.length") << length;
  }
  for (const double origin : {kNan, kInfinity, -kInfinity, -1e70}) {
    EXPECT_EQ(field_of(BoxOf(40, 40, origin)), "parameters.box.x.origin") << origin;
  }
  EXPECT_EQ(field_of({}), "parameters.box");
  EXPECT_TRUE(Validate(In(BoxOf(12, 1e8))).ok());
  ReconstructionParameters sliced = In(BoxOf(40, 40));
  sliced.slice = SlicePlane{};
  EXPECT_EQ(FindViolation(Validate(sliced))->field, "parameters.slice");
  // Without a given spacing, the frame decides.
  EXPECT_EQ(field_of(BoxOf(11, 40), std::nullopt), "OK");
  const Particles disc = support::Disc(4, 5, 5);
  State state;
  Workspace workspace;
  Result result;
  const auto small = FindViolation(Reconstructor::Create({.box = BoxOf(11, 40)})
                                       ->Reconstruct(disc.AsFrame(), state, workspace, result));
  ASSERT_TRUE(small.has_value());
  EXPECT_EQ(small->field, "parameters.box.x.length");
}

TEST(Periodic, ParticleTooFarFromTheBoxIsRefused) {
  Particles particles = support::Disc(6, 20, 20);
  particles.Add(20, 4.1e7);
  const auto violation = RefusalOf(In(BoxOf(40, 40)), particles);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, kReasonOutOfRange);
  EXPECT_EQ(violation->field, "positions[" + std::to_string(particles.size() - 1) + "].y");
}

TEST(Periodic, EmptyAndLoneFramesPass) {
  RingStream stream(In(BoxOf(40, 40)));
  EXPECT_EQ(stream.Next(Particles()).RingCount(), 0u);
  Particles lone;
  lone.Add(40, 0);
  EXPECT_EQ(stream.Next(lone).RingCount(), 1u);
}

TEST(ImageSets, OffsetsAddUpAlongLinks) {
  Random random(3);
  constexpr std::uint32_t kNodes = 200;
  std::vector<Image> truth(kNodes);
  for (Image& image : truth) {
    for (auto& along : image) along = static_cast<std::int64_t>(random.Below(7)) - 3;
  }
  ImageSets sets;
  sets.Reset(kNodes);
  for (int link = 0; link < 1000; ++link) {
    const auto a = static_cast<std::uint32_t>(random.Below(kNodes));
    const auto b = static_cast<std::uint32_t>(random.Below(kNodes));
    const auto from = sets.Find(a), to = sets.Find(b);
    if (from.root == to.root) {
      EXPECT_EQ(to.image - from.image, truth[b] - truth[a]);
    } else {
      sets.Join(from, to, truth[b] - truth[a]);
    }
  }
}

TEST(RunPeriods, WrappedRunsCoverEachNodeOnce) {
  for (const double period : {5.5, 7.0, 7.3, 7.5, 7.9}) {
    for (std::int64_t first = -30; first < 30; ++first) {
      std::vector<std::int64_t> nodes;
      ForEachWrapped(period, first, first + 5, [&](std::int32_t low, std::int32_t high) {
        for (std::int32_t node = low; node <= high; ++node) nodes.push_back(node);
      });
      ASSERT_EQ(nodes.size(), 6u);
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const std::int64_t node = first + static_cast<std::int64_t>(k);
        EXPECT_EQ(nodes[k], node - WrapOf(period, node));
        EXPECT_GE(nodes[k], 0 - 1);
        EXPECT_LE(nodes[k], 8);
      }
    }
  }
}

TEST(RunPeriods, RunOfManyPeriodsIsOnePeriod) {
  // An untrusted state may hold such a run.
  constexpr std::int64_t kFirst = std::numeric_limits<std::int32_t>::min(),
                         kLast = std::numeric_limits<std::int32_t>::max();
  for (const double period : {12.0, 12.3, 12.5, 1e9}) {
    for (const std::int64_t first : {kFirst, kFirst + 5, std::int64_t{-1}}) {
      std::int64_t parts = 0, nodes = 0;
      ForEachWrapped(period, first, kLast, [&](std::int32_t low, std::int32_t high) {
        ++parts;
        nodes += std::int64_t{high} - low + 1;
      });
      EXPECT_LE(parts, 3);
      EXPECT_EQ(nodes, static_cast<std::int64_t>(std::ceil(period)));
    }
  }
}

// The last request of Lift comes before the loops over copies.
TEST(Lift, IsCancelledWhileItCopies) {
  const std::vector<double> at = {1, 1, 1, 2, 2, 2};
  const Frame frame{.positions = std::span<const double>(at), .components = 3};
  const PeriodicBox box{.axes = {PeriodicAxis{0, 3}, PeriodicAxis{0, 3}, PeriodicAxis{0, 3}}};
  constexpr std::array kAxes = {0, 1, 2};
  std::atomic<bool> flag = false;
  const CancellationScope scope(&flag);
  for (const int requests : {4, 3}) {
    int left = requests;
    const auto reserve = [&](std::uint64_t) {
      if (--left == 0) flag = true;
      return absl::OkStatus();
    };
    LiftScratch scratch;
    LiftedFrame lifted;
    const auto lift = [&] {
      return Lift({.frame = frame,
                   .box = box,
                   .axes = kAxes,
                   .range = 2,
                   .margin = 3,
                   .wraps = true,
                   .reserve = reserve},
                  scratch, lifted);
    };
    if (requests == 4) {
      EXPECT_TRUE(lift().ok());
      EXPECT_EQ(lifted.originals.size(), 2 * 26u);
    } else {
      EXPECT_THROW((void)lift(), Cancelled);
    }
  }
}

}  // namespace
}  // namespace partiemc
