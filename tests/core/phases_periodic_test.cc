// Phases in periodic boxes: areas, interfaces and junctions are the same across a face and in the
// middle of the box.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "core/phases_in_boxes.h"
#include "partiemc/partiemc.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::ReconstructOnce;

// Phase 2 above a wave that repeats after kPhaseLength.
int LayerAt(double x, double y) {
  return y > 12 + 2 * std::sin(2 * M_PI * x / kPhaseLength) ? 2 : 1;
}

// The largest relative change of a value from call to call.
class Deviation {
 public:
  void Add(double value) {
    if (!first_) first_ = value;
    largest_ = std::max(largest_, std::abs(value / *first_ - 1));
  }
  double largest() const { return largest_; }

 private:
  std::optional<double> first_;
  double largest_ = 0;
};

constexpr std::array<double, 6> kPlaces = {0., 7., 20.5, 24., -31.25, 47.9};

TEST(PhasesPeriodic, LayersAreCutAnywhere) {
  const Particles layers = Labelled(48, 24, .1, LayerAt);
  double area_error = 0;
  std::array<Deviation, 2> areas;
  Deviation interface;
  for (const bool wraps : {false, true}) {
    for (const double origin : kPlaces) {
      SCOPED_TRACE(testing::Message() << "origin " << origin << ", wraps " << wraps);
      const PeriodicBox box = PhaseChannel(origin, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(layers, box));
      ExpectDivided(result, Fill::kGreedy);
      double perimeter = -result.statistics.perimeter;
      for (std::size_t k = 0; k < 2; ++k) {
        const Result& phase = result.sections[k];
        const double count = CountOf(layers, static_cast<float>(k + 1));
        EXPECT_EQ(phase.rings.RingCount(), 1u);
        EXPECT_EQ(phase.statistics.cut_bodies, 1u);
        EXPECT_EQ(static_cast<double>(phase.statistics.particles), count);
        EXPECT_EQ(static_cast<double>(ParticlesOf(phase.rings)), count);
        area_error = std::max(area_error, std::abs(phase.statistics.area / count - 1));
        areas[k].Add(phase.statistics.area);
        perimeter += phase.statistics.perimeter;
      }
      interface.Add(perimeter / 2);
    }
  }
  std::printf("layers: area off by %.1e, by place %.1e; interface by place %.1e\n", area_error,
              std::max(areas[0].largest(), areas[1].largest()), interface.largest());
  EXPECT_LT(area_error, 1e-6);
  for (const Deviation& area : areas) EXPECT_LT(area.largest(), 1e-7);
  EXPECT_LT(interface.largest(), 1e-8);
}

// A drop of phase 2 in phase 1, which fills the box.
TEST(PhasesPeriodic, DropsAreTheSameAcrossFaces) {
  const Particles scene = Labelled(
      48, 40, .1, [](double x, double y) { return std::hypot(x - 24, y - 20) < 7.3 ? 2 : 1; });
  const double count = CountOf(scene, 2);
  Deviation area, interface, rest;
  double error = 0;
  for (const bool wraps : {false, true}) {
    for (const auto& [x, y] : {std::pair(0., 0.),
                               {24., 0.},
                               {0., 20.},
                               {24., 20.},
                               {20.3, 17.7},
                               {28.6, 3.},
                               {24., 13.}}) {
      SCOPED_TRACE(testing::Message() << x << ", " << y << ", wraps " << wraps);
      const PeriodicBox box = PhaseCell(x, y, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(scene, box));
      ExpectDivided(result, Fill::kGreedy);
      EXPECT_NEAR(result.statistics.area, kPhaseLength * kPhaseHeight, 1e-6);
      EXPECT_NEAR(result.statistics.perimeter, 0, 1e-9);
      const Result& drop = result.sections[1];
      EXPECT_EQ(BodiesOf(drop.rings), 1u);
      EXPECT_EQ(static_cast<double>(ParticlesOf(drop.rings)), count);
      EXPECT_EQ(static_cast<double>(drop.statistics.particles), count);
      error = std::max(error, std::abs(drop.statistics.area / count - 1));
      area.Add(drop.statistics.area);
      interface.Add(drop.statistics.perimeter);
      rest.Add(result.sections[0].statistics.perimeter);
    }
  }
  std::printf("drop: area off by %.1e, by place %.1e; interface by place %.1e, %.1e\n", error,
              area.largest(), interface.largest(), rest.largest());
  EXPECT_LT(area.largest(), 1e-6);
  EXPECT_LT(interface.largest(), 1e-6);
  EXPECT_LT(error, 1e-5);
}

// The interfaces lie on a face, where lattice nodes and symmetric particles are, too.
TEST(PhasesPeriodic, FacesMayLieOnInterfaces) {
  const Particles stripes = Labelled(48, 40, 0, [](double x, double) { return x < 24 ? 1 : 2; });
  for (const bool wraps : {false, true}) {
    for (const double x : {0., 24., 1e-9, 24 - 1e-9, 12.}) {
      SCOPED_TRACE(testing::Message() << x << ", wraps " << wraps);
      const PeriodicBox box = PhaseCell(x, 0, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(stripes, box));
      ExpectDivided(result, Fill::kGreedy);
      for (const Result& phase : result.sections) {
        EXPECT_NEAR(phase.statistics.area, 960, 1e-4);
        EXPECT_EQ(BodiesOf(phase.rings), 1u);
      }
    }
  }
}

struct Junction {
  double x, y, angle;
};

// The junctions of a phase, moved into the box.
std::vector<Junction> JunctionsOf(const Rings& rings, const PeriodicBox& box) {
  std::vector<Junction> junctions;
  for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
    Junction junction{rings.points[2 * rings.contacts[k]], rings.points[2 * rings.contacts[k] + 1],
                      rings.contact_angles[k]};
    EXPECT_GE(junction.x, box.axes[0]->origin);
    EXPECT_LE(junction.x, box.axes[0]->origin + box.axes[0]->length);
    junction.x -= kPhaseLength * std::floor(junction.x / kPhaseLength);
    junction.y -= kPhaseHeight * std::floor(junction.y / kPhaseHeight);
    junctions.push_back(junction);
  }
  std::ranges::sort(junctions, {}, [](const Junction& j) { return std::pair(j.x, j.y); });
  return junctions;
}

// Three phases: a band of the second one between the others, with a drop of the third one on it.
TEST(PhasesPeriodic, JunctionsAreReportedOnceInTheBox) {
  const Particles scene = Labelled(48, 40, .05, [](double x, double y) {
    if (std::hypot(x - 24.2, y - 20.3) < 8.3) return 3;
    return y < 20.3 ? 1 : 2;
  });
  std::optional<std::vector<Junction>> first;
  double moved = 0, turned = 0;
  for (const bool wraps : {false, true}) {
    for (const auto& [x, y] : {std::pair(0., 0.), {24., 0.}, {24., 20.}, {16.3, 20.4}, {32., 3.}}) {
      SCOPED_TRACE(testing::Message() << x << ", " << y << ", wraps " << wraps);
      const PeriodicBox box = PhaseCell(x, y, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 3), Wrapped(scene, box));
      ExpectDivided(result, Fill::kGreedy);
      std::vector<Junction> all;
      for (const Result& phase : result.sections) {
        for (const Junction& junction : JunctionsOf(phase.rings, box)) all.push_back(junction);
      }
      ASSERT_EQ(all.size(), 6u);
      if (!first) first = all;
      for (std::size_t k = 0; k < all.size(); ++k) {
        moved = std::max(moved, std::hypot(all[k].x - (*first)[k].x, all[k].y - (*first)[k].y));
        turned = std::max(turned, std::abs(all[k].angle - (*first)[k].angle));
      }
    }
  }
  std::printf("junctions: moved by %.1e, angles by %.1e\n", moved, turned);
  EXPECT_LT(moved, 1e-6);
  EXPECT_LT(turned, 1e-5);
}

// Interfaces end at the outline of the body, where it has corners: a lens floats on a layer. The
// outline of the body alone has already perimeters that differ by 1e-4 with the place of the faces,
// because the means along its ring (vertices/virtual_plane.cc) reach to the ends of the copies.
TEST(PhasesPeriodic, ContactsWithCornersAreTheSameAnywhere) {
  const Particles scene = Labelled(48, 30, .05, [](double x, double y) {
    const double from = x - 24;
    if (y > 15 + 6 - from * from / 12 && y > 15) return 0;
    return y > 15 - 3 + from * from / 24 ? 2 : 1;
  });
  Particles fluid;
  for (std::size_t k = 0; k < scene.size(); ++k) {
    if (scene.phases[k] == 0) continue;
    fluid.Add(scene.x(k), scene.y(k));
    fluid.phases.push_back(scene.y(k) > 15 ? 2 : scene.phases[k]);
  }
  std::array<Deviation, 2> areas, perimeters;
  double total = 0;
  for (const bool wraps : {false, true}) {
    for (const double x : kPlaces) {
      SCOPED_TRACE(testing::Message() << x << ", wraps " << wraps);
      const PeriodicBox box = PhaseChannel(x, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(fluid, box));
      ExpectDivided(result, Fill::kGreedy);
      total =
          std::max(total, std::abs(result.statistics.area / static_cast<double>(fluid.size()) - 1));
      for (std::size_t k = 0; k < 2; ++k) {
        areas[k].Add(result.sections[k].statistics.area);
        perimeters[k].Add(result.sections[k].statistics.perimeter);
      }
    }
  }
  std::printf("floating lens: area off by %.1e, by place %.1e %.1e, perimeters %.1e %.1e\n", total,
              areas[0].largest(), areas[1].largest(), perimeters[0].largest(),
              perimeters[1].largest());
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_LT(areas[k].largest(), 3e-4);
    EXPECT_LT(perimeters[k].largest(), 3e-4);
  }
}

// A length that is no whole number of cells: the images lie differently in the lattice.
TEST(PhasesPeriodic, LengthsNeedNotBeWholeCells) {
  Deviation area, interface;
  double error = 0;
  for (const double x : kPlaces) {
    PeriodicBox box = PhaseCell(x, 3);
    box.axes[0]->length = 48.7;
    box.axes[1]->length = 40.6;
    Particles scene = Labelled(48, 40, .05, [](double px, double py) {
      return std::hypot(px - 24, py - 20) < 7.3 ? 2 : 1;
    });
    for (std::size_t k = 0; k < scene.size(); ++k) {
      scene.xy[2 * k] *= 48.7 / 48;
      scene.xy[2 * k + 1] *= 40.6 / 40;
    }
    scene.volumes.assign(scene.size(), static_cast<float>(48.7 * 40.6 / (48 * 40)));
    const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(scene, box));
    ExpectDivided(result, Fill::kGreedy);
    area.Add(result.sections[1].statistics.area);
    interface.Add(result.sections[1].statistics.perimeter);
    error = std::max(error, std::abs(result.sections[1].statistics.area /
                                         (CountOf(scene, 2) * 48.7 * 40.6 / (48 * 40)) -
                                     1));
  }
  std::printf("other lengths: area off by %.1e, by place %.1e, interface %.1e\n", error,
              area.largest(), interface.largest());
  EXPECT_LT(error, 1e-5);
  EXPECT_LT(area.largest(), 1e-5);
  EXPECT_LT(interface.largest(), 3e-4);
}

// Bodies that do not percolate are whole unless the box wraps: a disc of two halves.
TEST(PhasesPeriodic, DiscsOfTwoPhasesAreTheSameAcrossACorner) {
  Particles disc = support::Disc(8, 24, 20);
  for (std::size_t k = 0; k < disc.size(); ++k) {
    disc.phases.push_back(disc.x(k) + .3 * disc.y(k) > 30.1 ? 2 : 1);
  }
  Deviation whole, area, interface;
  for (const bool wraps : {false, true}) {
    for (const auto& [x, y] : {std::pair(0., 0.), {24., 0.}, {24., 20.}, {20.25, 17.5}}) {
      SCOPED_TRACE(testing::Message() << x << ", " << y << ", wraps " << wraps);
      const PeriodicBox box = PhaseCell(x, y, wraps);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(disc, box));
      ExpectDivided(result, Fill::kGreedy);
      EXPECT_EQ(result.statistics.cut_bodies, wraps && x > 0 ? 1u : 0u);
      EXPECT_EQ(BodiesOf(result.sections[1].rings), 1u);
      if (!wraps) {
        EXPECT_EQ(result.sections[1].rings.RingCount(), 1u);
        EXPECT_EQ(result.sections[1].rings.contacts.size(), 2u);
      }
      whole.Add(result.statistics.area);
      area.Add(result.sections[1].statistics.area);
      interface.Add(result.sections[0].statistics.perimeter +
                    result.sections[1].statistics.perimeter - result.statistics.perimeter);
    }
  }
  std::printf("disc of two halves: area by place %.1e, of a half %.1e, interface %.1e\n",
              whole.largest(), area.largest(), interface.largest());
  EXPECT_LT(area.largest(), 1e-6);
  EXPECT_LT(interface.largest(), 1e-6);
}

// The particles of each region of a phase.
std::vector<std::uint64_t> CountsOf(const Rings& rings) {
  std::vector<std::uint64_t> counts;
  for (const RingMeasures& ring : rings.measures) {
    if (ring.particle_count > 0) counts.push_back(ring.particle_count);
  }
  std::ranges::sort(counts);
  return counts;
}

// Near the end of the copies, a drop may be joined with another one.
TEST(PhasesPeriodic, RegionsKeepTheirParticlesAnywhere) {
  constexpr double kWidth = 19, kHeight = 15;
  for (std::uint64_t seed = 1; seed <= support::Tries(100u); ++seed) {
    support::Random random(seed);
    std::vector<std::array<double, 3>> drops(1 + random.Below(4));
    for (auto& [x, y, radius] : drops) {
      x = random.Uniform(0, kWidth);
      y = random.Uniform(0, kHeight);
      radius = random.Uniform(1.2, 5);
    }
    const Particles scene = Labelled(19, 15, .1, [&](double x, double y) {
      return std::ranges::any_of(drops,
                                 [&](const auto& drop) {
                                   return std::hypot(std::remainder(x - drop[0], kWidth),
                                                     std::remainder(y - drop[1], kHeight)) <
                                          drop[2];
                                 })
                 ? 2
                 : 1;
    });
    std::vector<std::vector<std::uint64_t>> expected;
    // Whole cells, so that the lattice lies alike.
    for (const auto& [x, y] : {std::pair(0., 0.), {-12., 0.}, {17., 14.}, {5., 9.}}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << x << ", " << y);
      const PeriodicBox box = BoxOf(kWidth, kHeight, x, y);
      const Result result = ReconstructOnce(PhasesIn(box, 2), Wrapped(scene, box));
      std::vector<std::vector<std::uint64_t>> counts;
      for (const Result& phase : result.sections) counts.push_back(CountsOf(phase.rings));
      if (expected.empty()) expected = counts;
      EXPECT_EQ(counts, expected);
    }
  }
}

}  // namespace
}  // namespace partiemc
