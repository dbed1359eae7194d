// Doubts, and streams whose first results are provisional.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;

struct Stream {
  explicit Stream(const ReconstructionParameters& parameters)
      : reconstructor(*Reconstructor::Create(parameters)) {}

  const Result& Take(const Frame& frame) {
    const absl::Status status = reconstructor.Reconstruct(frame, state, workspace, result);
    EXPECT_TRUE(status.ok()) << status;
    return result;
  }
  const Result& Take(const Particles& particles) { return Take(particles.AsFrame()); }

  Reconstructor reconstructor;
  State state;
  Workspace workspace;
  Result result;
};

bool Has(const Result& result, Doubt doubt) { return result.statistics.doubts.Has(doubt); }

bool IsContradicted(double spacing, const Particles& particles) {
  return Has(Stream({.spacing = spacing}).Take(particles), Doubt::kSpacingContradicted);
}

Particles Shaken(Particles particles, double most) {
  support::Random random(31);
  for (double& coordinate : particles.xy) coordinate += random.Uniform(-most, most);
  return particles;
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
    Stream undisturbed({.spacing_rule = rule});
    undisturbed.Take(body);
    EXPECT_TRUE(undisturbed.result.statistics.doubts.empty());
    EXPECT_NEAR(undisturbed.result.statistics.area, 600, 12);
    Stream stream({.spacing_rule = rule});
    for (const Particles& beginning : Beginnings()) {
      stream.Take(beginning);
      EXPECT_TRUE(Has(stream.result, Doubt::kSpacingProvisional));
      EXPECT_TRUE(Validate(stream.result).ok());
      EXPECT_EQ(stream.state, State{});
      for (const RingMeasures& ring : stream.result.rings.measures) EXPECT_EQ(ring.identity, 0u);
      // From the first frame that agrees on, the stream is one that begins with it.
      Stream next(stream.reconstructor.parameters());
      next.state = stream.state;
      EXPECT_EQ(next.Take(body), undisturbed.result);
      EXPECT_EQ(next.state, undisturbed.state);
    }
  }
}

TEST(Doubts, AGuessIsMadeOfTheFrameAlone) {
  Stream stream({});
  Particles pair;
  pair.Add(0, 0);
  pair.Add(3, 4);
  EXPECT_EQ(stream.Take(pair).statistics.spacing, 5);
  EXPECT_GT(stream.result.rings.RingCount(), 0u);
  EXPECT_EQ(stream.Take(support::Scaled(pair, 0.1)).statistics.spacing, 0.5);
  EXPECT_EQ(stream.Take(support::Lattice(1, 1)).statistics.spacing, 0);
  EXPECT_EQ(stream.result.rings.RingCount(), 0u);
  // Without particles there is nothing to doubt.
  EXPECT_TRUE(stream.Take(Frame{}).statistics.doubts.empty());
}

TEST(Doubts, VolumesAreABetterGuessThanDistances) {
  Particles drops;
  drops.Add(0, 0);
  drops.Add(3000, 4000);
  drops.volumes = {0.25f, 0.25f};
  Stream stream({});
  EXPECT_EQ(stream.Take(drops).statistics.spacing, 0.5);
  EXPECT_TRUE(Has(stream.result, Doubt::kSpacingProvisional));
  // The outlines of single particles are about twice as large as these.
  EXPECT_LT(stream.result.statistics.area, 1);
  EXPECT_EQ(stream.state, State{});
}

TEST(Doubts, AStreamThatIsResumedWhileItsSpacingIsAGuessGivesTheSameBits) {
  Stream stream({});
  for (const Particles& beginning : Beginnings()) {
    stream.Take(beginning);
    Stream resumed({});
    resumed.state = *ParseState(Serialize(stream.state));
    Stream next({});
    next.state = stream.state;
    for (const int frame : {0, 1, 2}) {
      EXPECT_EQ(resumed.Take(support::MovingBody(frame)), next.Take(support::MovingBody(frame)));
    }
  }
}

TEST(Doubts, WithEveryFramesSpacingThoseThatAgreeOnNoneTakeTheLastOne) {
  Stream stream({.spacing_rule = SpacingRule::kEveryFrame});
  stream.Take(support::Lattice(20, 20));
  for (const Particles& others : Beginnings()) {
    EXPECT_EQ(stream.Take(others).statistics.spacing, 1);
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
  Stream stream({});
  const Particles body = support::Lattice(30, 30);
  EXPECT_TRUE(stream.Take(body).statistics.doubts.empty());
  EXPECT_TRUE(Has(stream.Take(support::Scaled(body, 0.3)), Doubt::kSpacingContradicted));
  EXPECT_TRUE(Has(stream.Take(support::Scaled(body, 3)), Doubt::kSpacingContradicted));
  EXPECT_TRUE(stream.Take(body).statistics.doubts.empty());
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
    return Has(Stream({.spacing = 1.0}).Take(body), Doubt::kVolumesContradictSpacing);
  };
  // Discs of a diameter h, and hexagonal packing.
  for (const float volume : {0.785f, 0.866f, 1.0f, 1.9f, 0.55f}) EXPECT_FALSE(doubted(volume));
  for (const float volume : {2.1f, 0.45f, 1000.0f, 1e-3f}) EXPECT_TRUE(doubted(volume)) << volume;
  // A few large ones among many of the usual size.
  body.volumes.assign(body.size(), 1.0f);
  for (std::size_t k = 0; k < body.size() / 3; ++k) body.volumes[k] = 50;
  EXPECT_TRUE(Stream({.spacing = 1.0}).Take(body).statistics.doubts.empty());
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
    EXPECT_TRUE(Stream({.spacing = 0.01})
                    .Take(FloatFrame(body, offset).AsFrame())
                    .statistics.doubts.empty())
        << offset;
  }
  EXPECT_TRUE(Has(Stream({.spacing = 0.01}).Take(FloatFrame(body, 10'000).AsFrame()),
                  Doubt::kPositionsCoarse));
  for (const auto& spacing : {std::optional(0.01), std::optional<double>()}) {
    Stream stream({.spacing = spacing});
    stream.Take(body);
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
    EXPECT_TRUE(stream.Take(support::Shifted(body, 1e6, 1e6)).statistics.doubts.empty());
  }
}

TEST(Doubts, ACoordinateAcrossThePlaneMayBeAsCoarseAsItLikes) {
  std::vector<float> xyz;
  const Particles body = support::Scaled(support::Disc(6), 0.01);
  for (std::size_t k = 0; k < body.size(); ++k) {
    xyz.insert(xyz.end(), {static_cast<float>(body.x(k)), 1e7f, static_cast<float>(body.y(k))});
  }
  Stream stream({.spacing = 0.01, .plane = Plane::kXz});
  const Frame frame{.positions = std::span<const float>(xyz), .components = 3};
  EXPECT_TRUE(stream.Take(frame).statistics.doubts.empty());
}

}  // namespace
}  // namespace partiemc
