// Doubts, and streams whose first results are provisional.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/particles.h"
#include "support/result_stream.h"

namespace partiemc {
namespace {

using support::Particles;
using support::ResultStream;

bool Has(const Result& result, Doubt doubt) { return result.statistics.doubts.Has(doubt); }

bool IsContradicted(double spacing, const Particles& particles) {
  return Has(ResultStream({.spacing = spacing}).Next(particles), Doubt::kSpacingContradicted);
}

Particles Shaken(const Particles& particles, double most) {
  support::Random random(31);
  return support::Jittered(particles, random, most);
}

// First frames of a stream before a body exists.
std::vector<Particles> Beginnings() {
  support::Random random(32);
  Particles far_pair, near_pair;
  far_pair.Add(0, 0);
  far_pair.Add(3000, 4000);
  near_pair.Add(5, 5);
  near_pair.Add(5 + 1e-6, 5);
  Particles drops_with_ids = support::Noise(random, 10, 500);
  for (std::uint64_t k = 0; k < 10; ++k) drops_with_ids.ids.push_back(k);
  return {support::Lattice(1, 1),          far_pair,       near_pair,
          support::Noise(random, 10, 500), drops_with_ids, support::Lattice(30, 1)};
}

TEST(Doubts, NothingIsFixedByFramesThatAgreeOnNoSpacing) {
  const Particles body = Shaken(support::Lattice(30, 20), 0.1);
  for (const SpacingRule rule : {SpacingRule::kFirstFrame, SpacingRule::kEveryFrame}) {
    ResultStream undisturbed({.spacing_rule = rule});
    undisturbed.Next(body);
    EXPECT_TRUE(undisturbed.result.statistics.doubts.empty());
    EXPECT_NEAR(undisturbed.result.statistics.area, 600, 12);
    ResultStream stream({.spacing_rule = rule});
    for (const Particles& beginning : Beginnings()) {
      stream.Next(beginning);
      EXPECT_TRUE(Has(stream.result, Doubt::kSpacingProvisional));
      EXPECT_TRUE(Validate(stream.result).ok());
      EXPECT_EQ(stream.state, State{});
      for (const RingMeasures& ring : stream.result.rings.measures) EXPECT_EQ(ring.identity, 0u);
      // From the first frame that agrees on, the stream is one that begins with it.
      ResultStream next(stream.reconstructor.parameters());
      next.state = stream.state;
      EXPECT_EQ(next.Next(body), undisturbed.result);
      EXPECT_EQ(next.state, undisturbed.state);
    }
  }
}

TEST(Doubts, AGuessIsMadeOfTheFrameAlone) {
  ResultStream stream({});
  Particles pair;
  pair.Add(0, 0);
  pair.Add(3, 4);
  EXPECT_EQ(stream.Next(pair).statistics.spacing, 5);
  EXPECT_GT(stream.result.rings.RingCount(), 0u);
  EXPECT_EQ(stream.Next(support::Scaled(pair, 0.1)).statistics.spacing, 0.5);
  EXPECT_EQ(stream.Next(support::Lattice(1, 1)).statistics.spacing, 0);
  EXPECT_EQ(stream.result.rings.RingCount(), 0u);
  // Without particles there is nothing to doubt.
  EXPECT_TRUE(stream.Next(Frame{}).statistics.doubts.empty());
}

TEST(Doubts, VolumesAreABetterGuessThanDistances) {
  Particles drops;
  drops.Add(0, 0);
  drops.Add(3000, 4000);
  drops.volumes = {0.25f, 0.25f};
  ResultStream stream({});
  EXPECT_EQ(stream.Next(drops).statistics.spacing, 0.5);
  EXPECT_TRUE(Has(stream.result, Doubt::kSpacingProvisional));
  // The outlines of single particles are about twice as large as these.
  EXPECT_LT(stream.result.statistics.area, 1);
  EXPECT_EQ(stream.state, State{});
}

TEST(Doubts, AStreamThatIsResumedWhileItsSpacingIsAGuessGivesTheSameBits) {
  ResultStream stream({});
  for (const Particles& beginning : Beginnings()) {
    stream.Next(beginning);
    ResultStream resumed({});
    resumed.state = *ParseState(Serialize(stream.state));
    ResultStream next({});
    next.state = stream.state;
    for (const int frame : {0, 1, 2}) {
      EXPECT_EQ(resumed.Next(support::MovingBody(frame)), next.Next(support::MovingBody(frame)));
    }
  }
}

TEST(Doubts, WithEveryFramesSpacingThoseThatAgreeOnNoneTakeTheLastOne) {
  ResultStream stream({.spacing_rule = SpacingRule::kEveryFrame});
  stream.Next(support::Lattice(20, 20));
  for (const Particles& others : Beginnings()) {
    EXPECT_EQ(stream.Next(others).statistics.spacing, 1);
    EXPECT_FALSE(Has(stream.result, Doubt::kSpacingProvisional));
  }
}

TEST(Doubts, ASpacingThatParticlesContradictIsTold) {
  const Particles bodies[] = {support::Lattice(40, 40), Shaken(support::Lattice(40, 40), 0.2),
                              support::Disc(6), support::Lattice(120, 80)};
  for (const Particles& body : bodies) {
    // Single particles of a large frame would reach too many tiles.
    for (const double factor : {1e-3, 0.01, 0.1, 0.3, 0.4, 2.6, 3.0, 10.0, 1000.0}) {
      if (body.size() > 5000 && factor < 0.1) continue;
      EXPECT_TRUE(IsContradicted(factor, body)) << factor << " of " << body.size();
    }
    for (const double factor : {0.55, 0.8, 1.0, 1.3, 1.9}) {
      EXPECT_FALSE(IsContradicted(factor, body)) << factor << " of " << body.size();
    }
  }
}

TEST(Doubts, ASpacingOfTheStreamThatLaterFramesContradictIsToldToo) {
  ResultStream stream({});
  const Particles body = support::Lattice(30, 30);
  EXPECT_TRUE(stream.Next(body).statistics.doubts.empty());
  EXPECT_TRUE(Has(stream.Next(support::Scaled(body, 0.3)), Doubt::kSpacingContradicted));
  EXPECT_TRUE(Has(stream.Next(support::Scaled(body, 3)), Doubt::kSpacingContradicted));
  EXPECT_TRUE(stream.Next(body).statistics.doubts.empty());
}

TEST(Doubts, SprayAndFilmsContradictNothing) {
  support::Random random(33);
  for (const Particles& particles : Beginnings()) EXPECT_FALSE(IsContradicted(1, particles));
  EXPECT_FALSE(IsContradicted(1, support::Lattice(500, 1)));
  EXPECT_FALSE(IsContradicted(1, support::Scaled(support::Lattice(500, 1), 20)));
  EXPECT_FALSE(IsContradicted(1, support::Noise(random, 30, 1000)));
  EXPECT_FALSE(IsContradicted(1, support::WithDuplicates(support::Disc(9), random, 60)));
}

TEST(Doubts, DoNotDependOnTheOrderOfTheParticles) {
  support::Random random(34);
  for (const double factor : {0.4, 0.48, 0.52, 1.9, 2.0, 2.1}) {
    const Particles body = Shaken(support::Lattice(60, 60), 0.25);
    const bool expected = IsContradicted(factor, body);
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(IsContradicted(factor, support::Permuted(body, random)), expected) << factor;
    }
  }
}

TEST(Doubts, VolumesInAnotherUnitThanTheSpacingAreTold) {
  Particles body = support::Disc(12);
  const auto doubted = [&](float volume) {
    body.volumes.assign(body.size(), volume);
    body.volumes[0] = 1;
    return Has(ResultStream({.spacing = 1.0}).Next(body), Doubt::kVolumesContradictSpacing);
  };
  // Discs of a diameter h, and hexagonal packing.
  for (const float volume : {0.785f, 0.866f, 1.0f, 1.9f, 0.55f}) EXPECT_FALSE(doubted(volume));
  for (const float volume : {2.1f, 0.45f, 1000.0f, 1e-3f}) EXPECT_TRUE(doubted(volume)) << volume;
  // A few large ones among many of the usual size.
  body.volumes.assign(body.size(), 1.0f);
  for (std::size_t k = 0; k < body.size() / 3; ++k) body.volumes[k] = 50;
  EXPECT_TRUE(ResultStream({.spacing = 1.0}).Next(body).statistics.doubts.empty());
}

// A frame as float32, `offset` away from the origin.
struct FloatFrame {
  FloatFrame(const Particles& particles, double offset) {
    for (const double coordinate : particles.xy) {
      values.push_back(static_cast<float>(coordinate + offset));
    }
  }
  Frame AsFrame() const { return {.positions = std::span<const float>(values)}; }
  std::vector<float> values;
};

TEST(Doubts, FloatsThatAreTooCoarseForTheSpacingAreAnErrorOrADoubt) {
  const Particles body = support::Scaled(support::Disc(12), 0.01);
  // Steps of float32 there, in spacings: 1/10240 to 6.
  for (const double offset : {5.0, 1000.0, 5000.0}) {
    EXPECT_TRUE(ResultStream({.spacing = 0.01})
                    .Next(FloatFrame(body, offset).AsFrame())
                    .statistics.doubts.empty())
        << offset;
  }
  EXPECT_TRUE(Has(ResultStream({.spacing = 0.01}).Next(FloatFrame(body, 10'000).AsFrame()),
                  Doubt::kPositionsCoarse));
  for (const auto& spacing : {std::optional(0.01), std::optional<double>()}) {
    ResultStream stream({.spacing = spacing});
    stream.Next(body);
    const State before = stream.state;
    const absl::Status status = stream.reconstructor.Reconstruct(
        FloatFrame(body, 1e6).AsFrame(), stream.state, stream.workspace, stream.result);
    EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
    const auto violation = FindViolation(status);
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation->reason, kReasonResolution);
    EXPECT_EQ(violation->field, "positions");
    EXPECT_NE(violation->rule.find("send float64"), std::string::npos);
    EXPECT_EQ(stream.state, before);
    EXPECT_EQ(stream.result, Result{});
    // The same as float64 is fine.
    EXPECT_TRUE(stream.Next(support::Shifted(body, 1e6, 1e6)).statistics.doubts.empty());
  }
}

TEST(Doubts, ACoordinateAcrossThePlaneMayBeAsCoarseAsItLikes) {
  std::vector<float> xyz;
  const Particles body = support::Scaled(support::Disc(6), 0.01);
  for (std::size_t k = 0; k < body.size(); ++k) {
    xyz.insert(xyz.end(), {static_cast<float>(body.x(k)), 1e7f, static_cast<float>(body.y(k))});
  }
  ResultStream stream({.spacing = 0.01, .plane = Plane::kXz});
  const Frame frame{.positions = std::span<const float>(xyz), .components = 3};
  EXPECT_TRUE(stream.Next(frame).statistics.doubts.empty());
}

TEST(Doubts, WallsThatHideMostOfTheFluidAreReported) {
  Particles body = support::Lattice(20, 20, .5, .5);
  const auto doubted = [&](ReconstructionParameters parameters) {
    parameters.spacing = 1.0;
    return Has(ResultStream(parameters).Next(body), Doubt::kWallsHideFluid);
  };
  const auto floor = [](double y) { return ReconstructionParameters{.walls = {{{0, y, 1, y}}}}; };
  const auto ceiling = [](double y) { return ReconstructionParameters{.walls = {{{1, y, 0, y}}}}; };
  EXPECT_FALSE(doubted({}));
  EXPECT_FALSE(doubted(floor(0)));
  EXPECT_FALSE(doubted(floor(12)));
  EXPECT_TRUE(doubted(floor(15)));
  EXPECT_FALSE(doubted(ceiling(8)));
  EXPECT_TRUE(doubted(ceiling(5)));
  const Wall tank{{0, 0, 20, 0, 20, 20, 0, 20}};
  const Wall obstacle{{0, 20, 20, 20, 20, 0, 0, 0}};
  EXPECT_FALSE(doubted({.walls = {tank}}));
  EXPECT_TRUE(doubted({.walls = {obstacle}}));
  // Wall particles are no fluid.
  body.phases.assign(body.size(), 2);
  EXPECT_FALSE(doubted({.wall_phases = {3}}));
  EXPECT_TRUE(doubted({.wall_phases = {2}}));
  for (std::size_t k = 0; k < 40; ++k) body.phases[k] = 1;
  EXPECT_FALSE(doubted({.wall_phases = {2}}));
}

}  // namespace
}  // namespace partiemc
