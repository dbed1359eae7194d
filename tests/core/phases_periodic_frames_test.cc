// Phases in periodic boxes: random frames, streams, boxes that change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "core/phases_in_boxes.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/random.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::RefusalOf;
using support::RingStream;

// Gives particles labels: by stripes, drops or at random.
void DrawLabels(Random& random, int count, const PeriodicBox& box, Particles& particles) {
  const double width = random.Uniform(1, 15), angle = random.Uniform(0, 7);
  const std::size_t kind = random.Below(4);
  particles.phases.clear();
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double x = particles.x(k) - box.axes[0]->origin, y = particles.y(k);
    double place = static_cast<double>(random.Below(99));
    if (kind == 0) place = (x * std::cos(angle) + y * std::sin(angle)) / width;
    if (kind == 1) place = std::floor(x / width) + std::floor(y / width);
    if (kind == 2) place = std::floor(x / box.axes[0]->length * 2 * count);
    const auto cell = static_cast<int>(std::floor(place)) % count;
    particles.phases.push_back(static_cast<float>(1 + (cell + count) % count));
  }
}

TEST(PhasesPeriodic, PhasesDivideTheBodyInRandomFrames) {
  const auto tries = support::Tries<std::uint64_t>(600);
  std::size_t cut = 0, interfaces = 0, junctions = 0;
  for (std::uint64_t seed = 1; seed <= tries && !HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const auto length = [&] {
      return random.Chance(.5) ? std::floor(random.Uniform(13, 40)) : random.Uniform(13, 40);
    };
    PeriodicBox box = BoxOf(length(), length(), random.Uniform(-20, 20), random.Uniform(-9, 9));
    const double width = box.axes[0]->length, height = box.axes[1]->length;
    const double filled = random.Chance(.5) ? height : random.Uniform(2, height);
    if (random.Chance(.4)) box.axes[1].reset();
    box.wraps = random.Chance(.5);
    const int count = 1 + static_cast<int>(random.Below(4));
    ReconstructionParameters parameters = PhasesIn(box, count);
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.3)) parameters.cell_size = random.Uniform(.4, 1.5);
    if (random.Chance(.2)) parameters.clean = false;
    if (random.Chance(.2)) parameters.min_component_particles = random.Below(9);
    const double density = random.Chance(.7) ? random.Uniform(.7, 1.2) : random.Uniform(.02, .7);
    Particles particles;
    for (double k = density * width * filled; k > 0; --k) {
      const double x = random.Uniform(0, width);
      particles.Add(x, random.Uniform(0, filled));
    }
    if (random.Chance(.3)) {
      const double shift = random.Chance(.5) ? .5 : random.Uniform(0, 1);
      particles = support::Lattice(static_cast<int>(width), static_cast<int>(filled), shift, shift);
    }
    if (random.Chance(.2)) {
      parameters.sizes = Sizes::kOwn;
      for (std::size_t k = 0; k < particles.size(); ++k) {
        particles.volumes.push_back(random.Chance(.2) ? 1 : .25F);
      }
    }
    particles = Wrapped(std::move(particles), box);
    DrawLabels(random, count, box, particles);
    const Result result = ReconstructOnce(parameters, particles);
    ExpectDivided(result, parameters.fill);
    cut += result.rings.cuts.empty() ? 0 : 1;
    for (const Result& phase : result.sections) {
      interfaces += phase.rings.PointCount();
      junctions += phase.rings.contacts.size();
    }
    interfaces -= result.rings.PointCount();
  }
  std::printf("%zu frames cut, %zu points of interfaces, %zu junctions\n", cut, interfaces,
              junctions);
  EXPECT_GT(cut, tries / 2);
  EXPECT_GT(interfaces, 20 * tries);
}

TEST(PhasesPeriodic, DropsKeepIdentitiesWhileTheyCross) {
  for (const bool has_ids : {false, true}) {
    for (const bool wraps : {false, true}) {
      const PeriodicBox box = PhaseCell(0, 0, wraps);
      RingStream stream(PhasesIn(box, 2));
      std::array<std::vector<std::uint64_t>, 2> first;
      for (int step = 0; step < 100; ++step) {
        SCOPED_TRACE(testing::Message()
                     << "ids " << has_ids << ", wraps " << wraps << ", step " << step);
        Particles scene = Labelled(48, 40, .1, [](double x, double y) {
          return std::hypot(x - 24, y - 20) < 6 || std::hypot(x - 5, y - 8) < 5 ? 2 : 1;
        });
        if (has_ids) {
          for (std::size_t k = 0; k < scene.size(); ++k) scene.ids.push_back(k);
        }
        stream.Next(Wrapped(support::Shifted(std::move(scene), .9 * step, .7 * step), box));
        ExpectDivided(stream.result(), Fill::kGreedy);
        for (std::size_t k = 0; k < 2; ++k) {
          std::vector<std::uint64_t> identities;
          const Rings& rings = stream.result().sections[k].rings;
          for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
            const std::uint64_t identity = rings.measures[ring].identity;
            if (identity != 0 && rings.outer_of[ring] == kNoRing) identities.push_back(identity);
          }
          std::ranges::sort(identities);
          if (step == 0) first[k] = identities;
          ASSERT_EQ(first[k].size(), k + 1);
          ASSERT_EQ(identities, first[k]);
        }
      }
    }
  }
}

TEST(PhasesPeriodic, BitsDoNotDependOnThreads) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  const PeriodicBox box = PhaseCell(24, 20);
  const Particles scene = Labelled(48, 40, .2, [](double x, double y) {
    if (std::hypot(x - 24.2, y - 20.3) < 8.3) return 3;
    return y < 20.3 ? 1 : 2;
  });
  const Result expected = ReconstructOnce(PhasesIn(box, 3), scene);
  ASSERT_FALSE(expected.sections[2].rings.cuts.empty());
  for (const unsigned threads : {1u, 2u, 7u}) {
    Arena(threads).Execute([&] { EXPECT_EQ(ReconstructOnce(PhasesIn(box, 3), scene), expected); });
  }
}

// The box grows sideways and shrinks in height, as the particles do, and positions are filtered.
TEST(PhasesPeriodic, BoxesOfFramesAndTheNoiseFilterApply) {
  for (const bool wraps : {false, true}) {
    ReconstructionParameters parameters = PhasesIn(PhaseCell(0, 0, wraps), 2);
    parameters.noise_filter = .5;
    RingStream stream(parameters);
    std::array<std::uint64_t, 2> first{};
    for (int step = 0; step < 8; ++step) {
      SCOPED_TRACE(testing::Message() << "wraps " << wraps << ", step " << step);
      const double wide = 1 + .01 * step, high = 1 - .007 * step;
      Particles scene = Labelled(48, 40, .1, [](double x, double y) {
        const double dx = std::remainder(x, kPhaseLength), dy = std::remainder(y, kPhaseHeight);
        return std::hypot(dx, dy) < 9 ? 2 : 1;
      });
      scene.volumes.assign(scene.size(), static_cast<float>(wide * high));
      for (std::size_t k = 0; k < scene.size(); ++k) {
        scene.xy[2 * k] *= wide;
        scene.xy[2 * k + 1] *= high;
        scene.ids.push_back(k);
      }
      Frame frame = scene.AsFrame();
      frame.box = BoxOf(kPhaseLength * wide, kPhaseHeight * high);
      stream.Next(frame);
      ExpectDivided(stream.result(), Fill::kGreedy);
      EXPECT_NEAR(stream.result().statistics.area, kPhaseLength * kPhaseHeight * wide * high, 1e-6);
      for (std::size_t k = 0; k < 2; ++k) {
        const Rings& rings = stream.result().sections[k].rings;
        ASSERT_EQ(BodiesOf(rings), 1u);
        std::uint64_t identity = 0;
        for (const RingMeasures& ring : rings.measures)
          identity = std::max(identity, ring.identity);
        if (step == 0) first[k] = identity;
        EXPECT_EQ(identity, first[k]);
        const double count = CountOf(scene, static_cast<float>(k + 1));
        EXPECT_NEAR(stream.result().sections[k].statistics.area / (count * wide * high), 1, 1e-3);
      }
      // The state is stored between the frames.
      const auto restored = ParseState(Serialize(stream.state()));
      ASSERT_TRUE(restored.ok()) << restored.status();
      EXPECT_EQ(*restored, stream.state());
    }
  }
}

// Attributes are fitted in each phase, with the copies of its particles.
TEST(PhasesPeriodic, AttributesJumpAtInterfacesAcrossFaces) {
  const Particles scene = Labelled(48, 40, .05, [](double x, double y) {
    const double dx = std::remainder(x, kPhaseLength), dy = std::remainder(y, kPhaseHeight);
    return std::hypot(dx, dy) < 9 ? 2 : 1;
  });
  std::vector<float> densities;
  for (const float phase : scene.phases) densities.push_back(phase == 1 ? 1000 : 1);
  const std::vector<Attribute> attributes{{.name = "density", .values = densities},
                                          {.name = "phase", .values = scene.phases}};
  Frame frame = scene.AsFrame();
  frame.attributes = attributes;
  const Result result = ReconstructOnce(PhasesIn(PhaseCell(), 2), frame);
  for (std::size_t k = 0; k < 2; ++k) {
    const Result& phase = result.sections[k];
    ASSERT_EQ(phase.attributes.size(), 1u);
    ASSERT_EQ(phase.attributes[0].values.size(), phase.mesh.PointCount());
    const float expected = k == 0 ? 1000 : 1;
    for (const float value : phase.attributes[0].values) {
      EXPECT_NEAR(value, expected, 1e-3 * expected);
    }
  }
}

TEST(PhasesPeriodic, ErrorsNameTheGivenParticleAndTheRule) {
  Particles scene = Labelled(48, 40, 0, [](double x, double) { return x < 24 ? 1 : 2; });
  scene.xy[2 * 7] = 1e9;
  auto violation = RefusalOf(PhasesIn(PhaseCell(), 2), scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "positions[7].x");
  scene.xy[2 * 7] = 7.5;
  scene.phases[9] = .5;
  violation = RefusalOf(PhasesIn(PhaseCell(), 2), scene);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "attributes[phase][9]");
}

}  // namespace
}  // namespace partiemc
