// How far interfaces and junctions are from known ones. The test prints the table of
// core/PHASES.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/phase_scenes.h"
#include "support/reconstruct.h"

namespace partiemc {
namespace {

using support::Particles;
using support::PhaseScene;
using support::Random;

using Distance = std::function<double(double, double)>;

// Scenes have the phases 1 to 3 and are measured away from the outline of the body.
constexpr double kRadius = 18, kMargin = 3.5;

Distance Reversed(Distance distance) {
  return [=](double x, double y) { return -distance(x, y); };
}

// Negative on the left of a line through (x0, y0) at this angle.
Distance Line(double x0, double y0, double angle) {
  return
      [=](double x, double y) { return (x - x0) * std::sin(angle) - (y - y0) * std::cos(angle); };
}

Distance Both(Distance a, Distance b) {
  return [=](double x, double y) { return std::max(a(x, y), b(x, y)); };
}

Distance CircleAt(double x0, double y0, double radius) {
  return [=](double x, double y) { return std::hypot(x - x0, y - y0) - radius; };
}

struct KnownScene {
  std::string name;
  PhaseScene scene;
  Distance interface;                                // Of phase 2.
  double junction_x, junction_y;                     // Measured unless NaN.
  double most_at_rest, most_with_noise;              // Bounds of the mean deviation.
  double most_apart = 0, most_apart_with_noise = 0;  // Bounds of the junction's distance.
  // Angles of the phases at the junction or, without one, at the contacts; and bounds of their mean
  // errors. In degrees.
  std::vector<double> angles = {};
  double most_turned = 0, most_turned_with_noise = 0;
};

PhaseScene TwoPhases(const Distance& second) {
  return {support::DiscBody(kRadius), {{1, Reversed(second)}, {2, second}}};
}

std::vector<KnownScene> AllScenes(std::uint64_t seed) {
  Random random(seed);
  const double angle = random.Uniform(0, 3), x = random.Uniform(-2, 2), y = random.Uniform(-2, 2);
  std::vector<KnownScene> scenes;
  const auto nowhere = std::nan("");
  const Distance line = Line(x, y, angle);
  scenes.push_back({"line", TwoPhases(line), line, nowhere, nowhere, .05, .055});
  const double tilt = std::asin(line(0, 0) / kRadius) * 180 / std::numbers::pi;
  scenes.back().angles = {90 + tilt, 90 - tilt};
  scenes.back().most_turned = 4;
  scenes.back().most_turned_with_noise = 6;
  const Distance large = CircleAt(x, y, 9);
  scenes.push_back({"drop of 254", TwoPhases(large), large, nowhere, nowhere, .05, .055});
  const Distance small = CircleAt(x, y, std::sqrt(30 / std::numbers::pi));
  scenes.push_back({"drop of 30", TwoPhases(small), small, nowhere, nowhere, .06, .065});
  const double third = 2 * std::numbers::pi / 3;
  const auto sector = [&](int k) {
    return Both(Line(x, y, angle + k * third), Reversed(Line(x, y, angle + (k + 1) * third)));
  };
  scenes.push_back({"three sectors",
                    {support::DiscBody(kRadius), {{1, sector(0)}, {2, sector(1)}, {3, sector(2)}}},
                    sector(1),
                    x,
                    y,
                    .05,
                    .055,
                    .1,
                    .15,
                    {120, 120, 120},
                    4,
                    6});
  // Phase 2 has one half, phases 1 and 3 share the other one.
  const Distance across = Line(x, y, angle + std::numbers::pi / 2);
  scenes.push_back({"T",
                    {support::DiscBody(kRadius),
                     {{1, Both(Reversed(line), across)},
                      {2, line},
                      {3, Both(Reversed(line), Reversed(across))}}},
                    line,
                    x,
                    y,
                    .05,
                    .055,
                    .15,
                    .2,
                    {90, 180, 90},
                    4,
                    6});
  return scenes;
}

struct Figures {
  double deviation = 0, length = 0;
  double area = 0;      // The largest relative error of a phase's area.
  double junction = 0;  // Distance of the junction.
  double turned = 0;    // Error of angles, in degrees.
  int angles = 0;
};

// The point at which most phases meet, nearest to (x, y).
double DistanceOfJunction(const Result& result, double x, double y) {
  double nearest = 1e300;
  for (std::size_t k = 0; k < result.sections[0].rings.PointCount(); ++k) {
    const double px = result.sections[0].rings.points[2 * k];
    const double py = result.sections[0].rings.points[2 * k + 1];
    const bool is_shared = std::ranges::all_of(result.sections, [&](const Result& phase) {
      for (std::size_t j = 0; j < phase.rings.PointCount(); ++j) {
        if (phase.rings.points[2 * j] == px && phase.rings.points[2 * j + 1] == py) return true;
      }
      return false;
    });
    if (is_shared) nearest = std::min(nearest, std::hypot(px - x, py - y));
  }
  return nearest;
}

void MeasureAngles(const KnownScene& known, const Result& result, Figures& figures) {
  for (std::size_t phase = 0; phase < known.angles.size(); ++phase) {
    const Rings& rings = result.sections[phase].rings;
    for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
      const double x = rings.points[2 * rings.contacts[k]];
      const double y = rings.points[2 * rings.contacts[k] + 1];
      const bool is_junction = std::hypot(x - known.junction_x, y - known.junction_y) < 3;
      if (!is_junction && !std::isnan(known.junction_x)) continue;
      const double angle = rings.contact_angles[k] * 180 / std::numbers::pi;
      figures.turned += std::abs(angle - known.angles[phase]);
      ++figures.angles;
    }
  }
}

void Measure(const KnownScene& known, double noise, Random& random, Figures& figures) {
  Particles particles = Filled(known.scene, random);
  particles.volumes.assign(particles.size(), 1);
  particles = support::Shaken(particles, random, noise);
  ReconstructionParameters parameters{.spacing = 1.0};
  for (const auto& region : known.scene.regions) {
    parameters.sections.push_back({.phase = region.phase});
  }
  const Result result = support::ReconstructOnce(parameters, particles);
  for (std::size_t k = 0; k < result.sections.size(); ++k) {
    const auto count =
        std::ranges::count(particles.phases, static_cast<float>(*parameters.sections[k].phase));
    const double error = result.sections[k].statistics.area / static_cast<double>(count) - 1;
    figures.area = std::max(figures.area, std::abs(error));
  }
  const Rings& rings = result.sections[1].rings;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const auto points = rings.RingPoints(ring);
    const std::size_t count = points.size() / 2;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = (k + 1) % count;
      const double x = (points[2 * k] + points[2 * next]) / 2;
      const double y = (points[2 * k + 1] + points[2 * next + 1]) / 2;
      if (known.scene.body.distance(x, y) > -kMargin) continue;
      const double step =
          std::hypot(points[2 * next] - points[2 * k], points[2 * next + 1] - points[2 * k + 1]);
      figures.deviation += step * std::abs(known.interface(x, y));
      figures.length += step;
    }
  }
  if (!std::isnan(known.junction_x)) {
    figures.junction += DistanceOfJunction(result, known.junction_x, known.junction_y);
  }
  MeasureAngles(known, result, figures);
}

// A lens between two phases: the arcs meet at 120 degrees. Straight lines that are fitted to its
// arcs meet .4 to .6 too far outward.
TEST(PhasesAccuracy, JunctionsOfALens) {
  constexpr int kSeeds = 8;
  for (const double width : {10., 20.}) {
    for (const double noise : {0., .1}) {
      double turned = 0, apart = 0, outward = 0;
      int angles = 0;
      for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        Random random(seed);
        const double turn = random.Uniform(0, 3);
        const double radius = width / std::sqrt(3), away = radius / 2;
        const double x = away * std::cos(turn), y = away * std::sin(turn);
        const Distance lens = Both(CircleAt(x, y, radius), CircleAt(-x, -y, radius));
        const Distance half = Line(0, 0, turn + std::numbers::pi / 2);
        const PhaseScene scene{support::DiscBody(kRadius),
                               {{1, Both(Reversed(lens), half)},
                                {2, Both(Reversed(lens), Reversed(half))},
                                {3, lens}}};
        Particles particles = Filled(scene, random);
        particles.volumes.assign(particles.size(), 1);
        particles = support::Shaken(particles, random, noise);
        ReconstructionParameters parameters{.spacing = 1.0};
        for (const int phase : {1, 2, 3}) parameters.sections.push_back({.phase = phase});
        const Result result = support::ReconstructOnce(parameters, particles);
        const Rings& rings = result.sections[2].rings;
        // The junctions lie on this axis, half a width from the origin.
        const double axis_x = -std::sin(turn), axis_y = std::cos(turn);
        for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
          const double px = rings.points[2 * rings.contacts[k]];
          const double py = rings.points[2 * rings.contacts[k] + 1];
          const double along = std::abs(px * axis_x + py * axis_y) - width / 2;
          apart += std::hypot(along, px * axis_y - py * axis_x);
          outward += along;
          turned += std::abs(rings.contact_angles[k] * 180 / std::numbers::pi - 120);
          ++angles;
        }
      }
      std::printf(
          "lens of width %2.0f, noise %.1f: junctions off by %.3f, outward %.3f; angles %.2f\n",
          width, noise, apart / angles, outward / angles, turned / angles);
      EXPECT_EQ(angles, 2 * kSeeds);
      EXPECT_LE(apart / angles, noise > 0 ? .25 : .2);
      EXPECT_LE(turned / angles, noise > 0 ? 6 : 3);
    }
  }
}

// A lens that floats on a straight surface. The body's outline has corners at its contacts.
TEST(PhasesAccuracy, ContactsOfAFloatingLens) {
  constexpr int kSeeds = 8;
  constexpr double kWidth = 16, kAbove = .6, kBelow = .8;  // Angles at the surface, in radians.
  for (const double noise : {0., .1}) {
    double apart = 0, turned = 0, area = 0;
    int angles = 0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      Random random(seed);
      const double turn = random.Uniform(0, 6.28), up_x = -std::sin(turn), up_y = std::cos(turn);
      const double above = kWidth / 2 / std::sin(kAbove), below = kWidth / 2 / std::sin(kBelow);
      const double down = -above * std::cos(kAbove), up = below * std::cos(kBelow);
      const Distance lens =
          Both(CircleAt(down * up_x, down * up_y, above), CircleAt(up * up_x, up * up_y, below));
      const Distance bath =
          Both(CircleAt(0, 0, kRadius), [=](double x, double y) { return x * up_x + y * up_y; });
      const Distance body = [=](double x, double y) { return std::min(lens(x, y), bath(x, y)); };
      const PhaseScene scene{{body, kRadius + 1}, {{1, Both(bath, Reversed(lens))}, {2, lens}}};
      Particles particles = Filled(scene, random);
      particles.volumes.assign(particles.size(), 1);
      particles = support::Shaken(particles, random, noise);
      ReconstructionParameters parameters{.spacing = 1.0};
      for (const int phase : {1, 2}) parameters.sections.push_back({.phase = phase});
      const Result result = support::ReconstructOnce(parameters, particles);
      const Rings& rings = result.sections[1].rings;
      for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
        const double px = rings.points[2 * rings.contacts[k]];
        const double py = rings.points[2 * rings.contacts[k] + 1];
        apart += std::hypot(std::abs(px * up_y - py * up_x) - kWidth / 2, px * up_x + py * up_y);
        const double angle = rings.contact_angles[k];
        turned += std::abs(angle - kAbove - kBelow) * 180 / std::numbers::pi;
        ++angles;
      }
      const double all = result.statistics.area / static_cast<double>(particles.size());
      area = std::max(area, std::abs(all - 1));
    }
    std::printf("floating lens, noise %.1f: contacts off by %.3f, angles %.2f, area of all %.5f\n",
                noise, apart / angles, turned / angles, area);
    EXPECT_EQ(angles, 2 * kSeeds);
    EXPECT_LE(apart / angles, noise > 0 ? .25 : .2);
    EXPECT_LE(turned / angles, noise > 0 ? 6 : 4);
    EXPECT_LE(area, .001);
  }
}

// Small drops on a slab: corners of the slab and contacts are near each other.
TEST(PhasesAccuracy, BodiesWithContactsKeepTheirArea) {
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const double width = random.Uniform(5, 16), angle = random.Uniform(.5, 2.4);
    const double radius = width / 2 / std::sin(angle), down = -radius * std::cos(angle);
    const double half = width / 2 + random.Uniform(0, 6);
    const Distance slab = [=](double x, double y) {
      return std::max(std::abs(x) - half, std::max(y, -6 - y));
    };
    const Distance drop = Both(CircleAt(0, down, radius), [](double, double y) { return -y; });
    const Distance body = [=](double x, double y) { return std::min(slab(x, y), drop(x, y)); };
    const PhaseScene scene{{body, 24}, {{1, slab}, {2, drop}}};
    Particles particles = Filled(scene, random);
    particles.volumes.assign(particles.size(), 1);
    particles = support::Shaken(particles, random, random.Uniform(0, .2));
    ReconstructionParameters parameters{.spacing = 1.0};
    const double alone = support::ReconstructOnce(parameters, particles).statistics.area;
    for (const int phase : {1, 2}) parameters.sections.push_back({.phase = phase});
    const double area = support::ReconstructOnce(parameters, particles).statistics.area;
    worst = std::max(worst, std::abs(area / alone - 1));
  }
  std::printf("drops on slabs: areas change by at most %.5f\n", worst);
  EXPECT_LE(worst, .005);
}

TEST(PhasesAccuracy, DeviationFromKnownInterfaces) {
  constexpr int kSeeds = 8;
  std::printf("%-14s %8s %8s %8s %8s %10s %12s\n", "", "rest", "area", "noise", "area", "junctions",
              "angles");
  std::vector<Figures> rest(5), noisy(5);
  std::vector<KnownScene> scenes;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    scenes = AllScenes(seed);
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      Random random(seed);
      Measure(scenes[k], 0, random, rest[k]);
      Measure(scenes[k], .1, random, noisy[k]);
    }
  }
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const KnownScene& scene = scenes[k];
    const double at_rest = rest[k].deviation / rest[k].length;
    const double with_noise = noisy[k].deviation / noisy[k].length;
    const double turned = rest[k].turned / std::max(rest[k].angles, 1);
    const double turned_with_noise = noisy[k].turned / std::max(noisy[k].angles, 1);
    std::printf("%-14s %8.4f %8.5f %8.4f %8.5f %5.3f %5.3f %5.2f %5.2f\n", scene.name.c_str(),
                at_rest, rest[k].area, with_noise, noisy[k].area, rest[k].junction / kSeeds,
                noisy[k].junction / kSeeds, turned, turned_with_noise);
    EXPECT_LE(at_rest, scene.most_at_rest) << scene.name;
    EXPECT_LE(with_noise, scene.most_with_noise) << scene.name;
    EXPECT_LE(std::max(rest[k].area, noisy[k].area), .005) << scene.name;
    EXPECT_LE(rest[k].junction / kSeeds, scene.most_apart) << scene.name;
    EXPECT_LE(noisy[k].junction / kSeeds, scene.most_apart_with_noise) << scene.name;
    if (scene.angles.empty()) continue;
    const int all = kSeeds * (scene.name == "line" ? 4 : 3);  // Both phases have two contacts.
    EXPECT_EQ(rest[k].angles, all) << scene.name;
    EXPECT_EQ(noisy[k].angles, all) << scene.name;
    EXPECT_LE(turned, scene.most_turned) << scene.name;
    EXPECT_LE(turned_with_noise, scene.most_turned_with_noise) << scene.name;
  }
}

}  // namespace
}  // namespace partiemc
