// Outlines of several phases: guarantees, shared points, areas, states, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/divided_phases.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/instruction_sets.h"
#include "support/particles.h"
#include "support/phase_scenes.h"
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

Particles RandomPhases(std::uint64_t seed, int count) {
  Random random(seed);
  Particles particles = support::RandomScene(seed);
  DrawPhases(random, count, particles);
  return particles;
}

TEST(Phases, DivideTheBodyInRandomFrames) {
  const auto tries = support::Tries<std::uint64_t>(1'000);
  std::size_t interfaces = 0;
  for (std::uint64_t seed = 1; seed <= tries; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const int count = 1 + static_cast<int>(random.Below(4));
    ReconstructionParameters parameters = WithPhases(count);
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.2)) parameters.kernel_radius = random.Uniform(1.5, 4);
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.5, 2);
    const Result result = ReconstructOnce(parameters, RandomPhases(seed, count));
    ExpectDivided(result, parameters.fill);
    for (const Result& phase : result.sections) interfaces += phase.rings.PointCount();
    interfaces -= result.rings.PointCount();
  }
  EXPECT_GT(interfaces, 20 * tries);
}

// A kernel may reach 32 cells, and by rounding a little more.
TEST(Phases, KernelsReachWholeTiles) {
  ReconstructionParameters parameters = WithPhases(2);
  parameters.sizes = Sizes::kOwn;
  parameters.kernel_radius = 8;
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const double shift = random.Uniform(-40, 40);
    Particles particles = support::Shifted(support::Lattice(40, 40), shift, shift / 2);
    particles.volumes.assign(particles.size(), 1);
    particles.volumes[random.Below(particles.size())] = std::nextafterf(16, 17);
    DrawPhases(random, 2, particles);
    ExpectDivided(ReconstructOnce(parameters, particles), parameters.fill);
  }
}

// Everything that changes where phases meet.
TEST(Phases, DivideTheBodyWithAnyParameters) {
  const auto tries = support::Tries<std::uint64_t>(300);
  for (std::uint64_t seed = 1; seed <= tries; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const int count = 1 + static_cast<int>(random.Below(16));
    ReconstructionParameters parameters = WithPhases(count);
    parameters.kernel_radius = random.Uniform(1.5, 8);
    parameters.cell_size = std::array{.3, .5, 1.0, 2.0, 4.0}[random.Below(5)];
    Particles particles = RandomPhases(seed, count + static_cast<int>(random.Below(2)));
    if (random.Chance(.5)) parameters.clean = random.Chance(.5);
    if (random.Chance(.3)) parameters.min_component_particles = 5;
    if (random.Chance(.3)) parameters.min_component_area = random.Uniform(0, 20);
    if (random.Chance(.3)) {
      parameters.sizes = Sizes::kOwn;
      parameters.kernel_radius = 3;
      particles.volumes.clear();
      for (std::size_t k = 0; k < particles.size(); ++k) {
        particles.volumes.push_back(random.Chance(.2) ? 4 : 1);
      }
    }
    if (random.Chance(.2)) parameters.sections.resize(1 + parameters.sections.size() / 2);
    if (parameters.sections.size() == static_cast<std::size_t>(count)) {
      parameters.sections.back() = {.phase = -7};  // No particle has it.
    }
    const Result result = ReconstructOnce(parameters, particles);
    for (const Result& phase : result.sections) {
      const absl::Status status = Validate(phase, parameters.fill);
      EXPECT_TRUE(status.ok()) << status;
    }
    EXPECT_TRUE(Validate(result, parameters.fill).ok());
  }
}

// A region without particles changes no other one.
TEST(Phases, EmptyRegionsLeaveOthersInPlace) {
  Random random(9);
  Particles particles = support::Lattice(30, 30);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.phases.push_back(particles.x(k) < 15 ? 1 : 2);
  }
  // Two particles that are not in the body's lattice of phases: lone ones of a third phase.
  for (const double x : {7.5, 22.5}) {
    particles.Add(x, 10.5);
    particles.phases.push_back(3);
  }
  const Result result = ReconstructOnce(WithPhases(2), particles);
  EXPECT_NEAR(result.sections[0].statistics.area, 450, 3);
  EXPECT_NEAR(result.sections[1].statistics.area, 450, 3);
}

// The state of a stream does not depend on the streams that used the workspace before.
TEST(Phases, StatesDoNotDependOnTheWorkspace) {
  const Particles particles = RandomPhases(7, 2);
  ReconstructionParameters others = WithPhases(2);
  others.sections = {{}, {}};
  const auto state_of = [&](Workspace& workspace) {
    State state;
    Result result;
    const auto reconstructor = Reconstructor::Create(WithPhases(2));
    EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), state, workspace, result).ok());
    return Serialize(state);
  };
  Workspace fresh, used;
  State state;
  Result result;
  const auto other = Reconstructor::Create(others);
  for (int k = 0; k < 2; ++k) {
    ASSERT_TRUE(other->Reconstruct(particles.AsFrame(), state, used, result).ok());
  }
  EXPECT_EQ(state_of(used), state_of(fresh));
}

TEST(Phases, AnyNumberOfThreadsGivesTheSameBits) {
  const Particles particles = RandomPhases(7, 3);
  std::vector<std::uint64_t> digests;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Result result = ReconstructOnce(WithPhases(3), particles);
    for (const Result& phase : result.sections) digests.push_back(DigestRings(phase.rings));
  }
  for (std::size_t k = 3; k < digests.size(); ++k) EXPECT_EQ(digests[k], digests[k - 3]);
}

TEST(Phases, AnyInstructionSetGivesTheSameBits) {
  const Particles particles = RandomPhases(7, 3);
  const auto digests = [&] { return DigestSections(ReconstructOnce(WithPhases(3), particles)); };
  const auto expected = digests();
  support::ForEachInstructionSet([&] { EXPECT_EQ(digests(), expected); });
}

TEST(Phases, OnePhaseHasTheOutlineOfTheBody) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Particles particles = RandomPhases(seed, 1);
    const ReconstructionParameters parameters = WithPhases(1);
    const Result result = ReconstructOnce(parameters, particles);
    EXPECT_EQ(FaceSegmentsOf(result.sections[0].rings).free, FaceSegmentsOf(result.rings).free);
    ReconstructionParameters alone = parameters;
    alone.sections.clear();
    EXPECT_EQ(DigestRings(ReconstructOnce(alone, particles).rings), DigestRings(result.rings));
  }
}

// Sections name only some phases; the others are one more phase.
TEST(Phases, OtherPhasesLeaveTheirPlace) {
  const auto half = [](double angle) {
    return [=](double x, double y) { return x * std::cos(angle) + y * std::sin(angle); };
  };
  support::PhaseScene scene{support::DiscBody(14), {}};
  for (std::int32_t k = 0; k < 4; ++k) {
    const double angle = .2 + 1.5708 * k;
    scene.regions.push_back({1 + k, [=](double x, double y) {
                               return std::max(half(angle)(x, y), half(angle + 1.5708)(x, y));
                             }});
  }
  Random random(4);
  const Particles particles = Filled(scene, random);
  const Result all = ReconstructOnce(WithPhases(4), particles);
  ReconstructionParameters parameters = WithPhases(4);
  parameters.sections.erase(parameters.sections.begin() + 1);
  const Result three = ReconstructOnce(parameters, particles);
  for (const std::size_t phase : {0u, 2u, 3u}) {
    const auto& expected = all.sections[phase].rings.points;
    const auto& points = three.sections[phase > 1 ? phase - 1 : phase].rings.points;
    ASSERT_EQ(points.size(), expected.size());
    // Sums are in the order of the sections, and arcs run from the earlier to the later one.
    for (std::size_t k = 0; k < points.size(); ++k) ASSERT_NEAR(points[k], expected[k], 1e-4);
  }
}

TEST(Phases, CountsParticlesAndTracksRings) {
  const auto line = [](double x, double y) { return .8 * x + .6 * y; };
  const support::PhaseScene scene{
      support::DiscBody(12), {{1, line}, {2, [=](double x, double y) { return -line(x, y); }}}};
  Random random(3);
  Particles particles = Filled(scene, random);
  RingStream stream(WithPhases(2));
  stream.Next(particles);
  std::array<std::uint64_t, 2> identities{}, particle_count{};
  for (std::size_t phase = 0; phase < 2; ++phase) {
    const Rings& rings = stream.result().sections[phase].rings;
    ASSERT_EQ(rings.RingCount(), 1u);
    identities[phase] = rings.measures[0].identity;
    particle_count[phase] = rings.measures[0].particle_count;
    EXPECT_NE(identities[phase], 0u);
    EXPECT_EQ(stream.result().sections[phase].statistics.particles,
              std::ranges::count(particles.phases, static_cast<float>(phase + 1)));
  }
  EXPECT_NEAR(static_cast<double>(particle_count[0] + particle_count[1]),
              static_cast<double>(particles.size()), 4);
  // The state is stored between the frames.
  const auto bytes = Serialize(stream.state());
  const auto restored = ParseState(bytes);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(*restored, stream.state());
  for (double& coordinate : particles.xy) coordinate += .3;
  stream.Next(particles);
  for (std::size_t phase = 0; phase < 2; ++phase) {
    EXPECT_EQ(stream.result().sections[phase].rings.measures[0].identity, identities[phase]);
  }
}

// Attributes are fitted to the particles of each phase alone, so they may jump at interfaces.
TEST(Phases, AttributesJumpAtInterfaces) {
  const auto line = [](double x, double y) { return .8 * x + .6 * y; };
  const support::PhaseScene scene{
      support::DiscBody(12), {{1, line}, {2, [=](double x, double y) { return -line(x, y); }}}};
  Random random(3);
  const Particles particles = Filled(scene, random);
  std::vector<float> densities;
  for (const float phase : particles.phases) densities.push_back(phase == 1 ? 1000 : 1);
  const std::vector<Attribute> attributes{{.name = "density", .values = densities},
                                          {.name = "phase", .values = particles.phases}};
  Frame frame = particles.AsFrame();
  frame.attributes = attributes;
  const Result result = ReconstructOnce(WithPhases(2), frame);
  for (std::size_t phase = 0; phase < 2; ++phase) {
    const Result& section = result.sections[phase];
    ASSERT_EQ(section.attributes.size(), 1u);
    EXPECT_EQ(section.attributes[0].name, "density");
    ASSERT_EQ(section.attributes[0].values.size(), section.mesh.PointCount());
    const float expected = phase == 0 ? 1000 : 1;
    for (const float value : section.attributes[0].values) {
      EXPECT_NEAR(value, expected, 1e-3 * expected);
    }
  }
}

TEST(Phases, RefusesFramesWithoutPhases) {
  const auto violation = RefusalOf(WithPhases(2), support::Lattice(5, 5));
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->reason, kReasonNoSuchAttribute);
  EXPECT_EQ(violation->field, "attributes");
  EXPECT_EQ(violation->value, "phase");
  EXPECT_EQ(ReconstructOnce(WithPhases(2), Particles()).sections[1].rings.RingCount(), 0u);
  Particles particles = support::Lattice(5, 5);
  // The reason and the field of a refused frame with these attributes.
  particles.phases.assign(25, 1);
  const auto refusal = [&](std::vector<Attribute> attributes) {
    Frame frame = particles.AsFrame();
    frame.attributes = attributes;
    State state;
    Workspace workspace;
    Result result;
    const absl::Status status =
        Reconstructor::Create(WithPhases(2))->Reconstruct(frame, state, workspace, result);
    EXPECT_EQ(state, State());
    const auto broken = FindViolation(status);
    return broken ? broken->reason + " " + broken->field : "";
  };
  const std::vector<float> half(25, .5f), not_a_number(25, std::nanf("")), two(50, 1);
  EXPECT_EQ(refusal({{.name = "phase", .values = std::span(half).first(24)}}),
            "COUNT attributes[0].values");
  EXPECT_EQ(refusal({{.name = "phase", .values = half}}), "OUT_OF_RANGE attributes[phase][0]");
  EXPECT_EQ(refusal({{.name = "phase", .values = not_a_number}}),
            "NOT_FINITE attributes[0].values[0]");
  EXPECT_EQ(refusal({{.name = "phase", .components = 2, .values = two}}),
            "OUT_OF_RANGE attributes[phase]");
  EXPECT_EQ(refusal({{.name = "phase", .values = particles.phases},
                     {.name = "phase", .values = particles.phases}}),
            "DUPLICATE attributes[1].name");
}

TEST(Phases, RefusesWhatHasNoPhases) {
  const auto field_of = [](const ReconstructionParameters& parameters) {
    const auto violation = FindViolation(Validate(parameters));
    return violation ? violation->field + "=" + violation->value : "";
  };
  EXPECT_EQ(field_of(WithPhases(16)), "");
  const auto with = [&](auto change) {
    ReconstructionParameters parameters = WithPhases(2);
    change(parameters);
    return field_of(parameters);
  };
  using P = ReconstructionParameters;
  EXPECT_EQ(with([](P& p) { p.isovalue = .5; }), "parameters.sections[0].phase=1");
  EXPECT_EQ(with([](P& p) { p.slice = SlicePlane(); }), "parameters.sections[0].phase=1");
  EXPECT_EQ(with([](P& p) { p.placement = Placement::kQef; }), "parameters.sections[0].phase=1");
  EXPECT_EQ(with([](P& p) { p.output = Output::kSurface; }), "parameters.sections[0].phase=1");
  EXPECT_EQ(with([](P& p) {
              p.sizes = Sizes::kOwn;
              p.boundary = Boundary::kGrains;
            }),
            "parameters.sections[0].phase=1");
  EXPECT_EQ(with([](P& p) { p.sections[1].phase = 1; }), "parameters.sections[1].phase=1");
  EXPECT_EQ(with([](P& p) { p.sections[1].isovalue = .5; }), "parameters.sections[1].phase=2");
  EXPECT_EQ(with([](P& p) { p.sections.push_back({.isovalue = .5}); }), "");
  EXPECT_EQ(with([](P& p) { p.phase_attribute = ""; }), "parameters.phase_attribute=empty");
  EXPECT_EQ(with([](P& p) { p.phase_attribute = "a\n"; }),
            "parameters.phase_attribute=not printable");
  EXPECT_EQ(with([](P& p) { p.phase_attribute = std::string(65, 'a'); }),
            "parameters.phase_attribute=65 bytes");
  EXPECT_EQ(with([](P& p) { p.sections[0].phase = (1 << 24) + 1; }),
            "parameters.sections[0].phase=16777217");
}

}  // namespace
}  // namespace partiemc
