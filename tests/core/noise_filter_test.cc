// The noise filter of outlines (core/NOISE.md).
#include "filter/noise_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/motion_oracle.h"
#include "support/noisy_particles.h"
#include "support/numbers.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"

namespace partiemc {
namespace {

using support::Filtering;
using support::kNan;
using support::LargestOffset;
using support::Particles;
using support::Random;
using support::RingStream;
using support::Shaken;
using support::WithIds;

// A disc of which some particles are new and some have gone, in any order.
Particles ChangingDisc(int frame, Random& random) {
  Particles disc = WithIds(support::Disc(9, .7 * frame, -.3 * frame));
  disc = Shaken(disc, .1, random);
  Particles kept;
  for (std::size_t k = 0; k < disc.size(); ++k) {
    if ((k + static_cast<std::size_t>(frame)) % 11 == 0) continue;
    kept.Add(disc.x(k), disc.y(k));
    kept.ids.push_back(disc.ids[k]);
  }
  return support::Permuted(kept, random);
}

// The filtered position of a particle minus its given one, in cells.
std::array<double, 2> OffsetOf(const State& state, std::uint64_t id) {
  const auto found = std::ranges::lower_bound(state.noise.ids, id);
  const auto rank = static_cast<std::size_t>(found - state.noise.ids.begin());
  return {state.noise.offsets.at(2 * rank), state.noise.offsets.at(2 * rank + 1)};
}

TEST(NoiseFilter, EqualsBruteForce) {
  for (const bool is_periodic : {false, true}) {
    SCOPED_TRACE(is_periodic);
    ReconstructionParameters parameters = Filtering(.4);
    support::FilterOracle oracle{.weight = .4};
    if (is_periodic) {
      parameters.box = PeriodicBox{.axes = {PeriodicAxis{-10, 30.3}, PeriodicAxis{-14, 28}}};
      oracle.box = parameters.box;
    }
    RingStream stream(parameters);
    Random random(3);
    for (int frame = 0; frame < 8; ++frame) {
      const Particles disc = ChangingDisc(frame, random);
      stream.Next(disc);
      std::vector<Vec3> at;
      for (std::size_t k = 0; k < disc.size(); ++k) at.push_back({disc.x(k), disc.y(k)});
      oracle.Next(disc.ids, at);
      ASSERT_EQ(stream.state().noise.ids.size(), disc.size());
      for (const std::uint64_t id : disc.ids) {
        const auto offset = OffsetOf(stream.state(), id);
        EXPECT_NEAR(offset[0], oracle.known.at(id).offset.x, 1e-6);
        EXPECT_NEAR(offset[1], oracle.known.at(id).offset.y, 1e-6);
      }
    }
    EXPECT_GT(LargestOffset(stream.state()), .05);
  }
}

TEST(NoiseFilter, OutlineIsThatOfTheFilteredPositions) {
  RingStream filtered(Filtering()), plain;
  Random random(4);
  for (int frame = 0; frame < 4; ++frame) {
    Particles disc = ChangingDisc(frame, random);
    filtered.Next(disc);
    for (std::size_t k = 0; k < disc.size(); ++k) {
      const auto offset = OffsetOf(filtered.state(), disc.ids[k]);
      disc.xy[2 * k] += offset[0];
      disc.xy[2 * k + 1] += offset[1];
    }
    plain.Next(disc);
    EXPECT_EQ(filtered.rings(), plain.rings());
    EXPECT_EQ(filtered.result().mesh, plain.result().mesh);
  }
}

TEST(NoiseFilter, FirstFrameAndWeightOneKeepTheirBits) {
  RingStream filtered(Filtering()), given(Filtering(1)), plain;
  Random random(5);
  for (int frame = 0; frame < 4; ++frame) {
    const Particles disc = ChangingDisc(frame, random);
    plain.Next(disc);
    given.Next(disc);
    filtered.Next(disc);
    EXPECT_EQ(given.result(), plain.result());
    EXPECT_EQ(filtered.rings() == plain.rings(), frame == 0);
  }
}

TEST(NoiseFilter, OrderAndThreadsChangeNoPosition) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 5);
  Random random(6);
  std::vector<Particles> frames;
  for (int k = 0; k < 3; ++k) {
    frames.push_back(WithIds(Shaken(support::Disc(60, .4 * k), .1, random)));
  }
  RingStream stream(Filtering());
  Arena one(1);
  one.Execute([&] {
    for (const Particles& frame : frames) stream.Next(frame);
  });
  for (const unsigned threads : {2u, 5u}) {
    RingStream other(Filtering()), permuted(Filtering());
    Arena arena(threads);
    arena.Execute([&] {
      for (const Particles& frame : frames) {
        other.Next(frame);
        permuted.Next(support::Permuted(frame, random));
      }
    });
    EXPECT_EQ(other.result(), stream.result());
    EXPECT_EQ(other.state(), stream.state());
    EXPECT_EQ(permuted.state().noise, stream.state().noise);
  }
  EXPECT_GT(LargestOffset(stream.state()), .1);
}

TEST(NoiseFilter, WrongWeightsAndFramesWithoutIdsAreRefused) {
  for (const double weight : {0.0, -.5, 1.01, kNan}) {
    const auto violation = FindViolation(Validate(Filtering(weight)));
    ASSERT_TRUE(violation) << weight;
    EXPECT_EQ(violation->reason, kReasonOutOfRange);
    EXPECT_EQ(violation->field, "parameters.noise_filter");
  }
  EXPECT_TRUE(Validate(Filtering(1)).ok());
  RingStream stream(Filtering());
  const auto violation = FindViolation(stream.Try(support::Disc(5)));
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->reason, kReasonCount);
  EXPECT_EQ(violation->field, "ids");
  EXPECT_EQ(violation->value, "0 values");
  EXPECT_TRUE(stream.Try({}).ok());
}

TEST(NoiseFilter, RefusedFramesChangeNothing) {
  ReconstructionParameters parameters = Filtering();
  parameters.box = PeriodicBox{.axes = {PeriodicAxis{-20, 40}, PeriodicAxis{-20, 40}}};
  parameters.placement = Placement::kFarthestParticle;  // Refuses bodies that must be cut.
  RingStream stream(parameters), undisturbed(parameters);
  Random random(7);
  for (int frame = 0; frame < 4; ++frame) {
    const Particles disc = WithIds(Shaken(support::Disc(6, frame), .1, random));
    EXPECT_EQ(stream.Next(disc), undisturbed.Next(disc));
    const State before = stream.state();
    Particles broken = disc;
    broken.xy[5] = kNan;
    EXPECT_FALSE(stream.Try(broken).ok());
    broken = disc;
    broken.ids.clear();
    EXPECT_FALSE(stream.Try(broken).ok());
    // Refused after the filter: the body reaches its own image.
    const auto percolates = FindViolation(stream.Try(WithIds(support::Lattice(40, 3, -20, 0))));
    ASSERT_TRUE(percolates);
    EXPECT_EQ(percolates->reason, kReasonPercolates);
    EXPECT_EQ(stream.state(), before);
  }
  EXPECT_EQ(stream.state(), undisturbed.state());
}

TEST(NoiseFilter, NewAndJumpingParticlesKeepTheirPosition) {
  RingStream stream(Filtering());
  Random random(8);
  const auto disc_at = [&](int frame) {
    return WithIds(Shaken(support::Disc(6, .4 * frame), .1, random));
  };
  stream.Next(disc_at(0));
  Particles disc = disc_at(1);
  disc.xy[0] += 1.6;   // Farther than the surprise that the filter accepts.
  disc.xy[20] += 1e3;  // Another particle uses the id.
  disc.Add(.5, .5);
  disc.ids.push_back(1'000'000);
  stream.Next(disc);
  for (const std::uint64_t id : {disc.ids[0], disc.ids[10], disc.ids.back()}) {
    EXPECT_EQ(OffsetOf(stream.state(), id), (std::array<double, 2>{0, 0})) << id;
  }
  // The others are not disturbed by the particle that is far away.
  EXPECT_NE(OffsetOf(stream.state(), disc.ids[11])[0], 0);
  EXPECT_LT(LargestOffset(stream.state()), .3);
  // A particle that left and returns is new.
  Particles without = disc_at(2);
  without.xy.erase(without.xy.begin(), without.xy.begin() + 2);
  without.ids.erase(without.ids.begin());
  stream.Next(without);
  stream.Next(disc_at(3));
  EXPECT_EQ(OffsetOf(stream.state(), 0), (std::array<double, 2>{0, 0}));
}

TEST(NoiseFilter, FramesBeforeTheSpacingIsKnownAreNotFiltered) {
  Random random(9);
  ReconstructionParameters parameters = Filtering();
  parameters.spacing.reset();
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  const Particles noise = WithIds(support::Noise(random, 30, 60));
  ASSERT_TRUE(reconstructor->Reconstruct(noise.AsFrame(), state, workspace, result).ok());
  EXPECT_TRUE(result.statistics.doubts.Has(Doubt::kSpacingProvisional));
  EXPECT_EQ(state, State());
  for (int frame = 0; frame < 2; ++frame) {
    const Particles disc = WithIds(Shaken(support::Disc(9), .02, random));
    ASSERT_TRUE(reconstructor->Reconstruct(disc.AsFrame(), state, workspace, result).ok());
    EXPECT_EQ(state.noise.ids.size(), disc.size());
    EXPECT_EQ(LargestOffset(state) > 0, frame == 1);
  }
}

TEST(NoiseFilter, ResumesFromItsBytes) {
  ReconstructionParameters parameters = Filtering();
  parameters.sections = {{.isovalue = .3}};
  RingStream undisturbed(parameters), resumed(parameters);
  Random random(10);
  for (int frame = 0; frame < 6; ++frame) {
    const Particles disc = ChangingDisc(frame, random);
    undisturbed.Next(disc);
    const std::string bytes = Serialize(resumed.state());
    EXPECT_EQ(bytes.size(), SerializedBytes(resumed.state()));
    auto parsed = ParseState(bytes);
    ASSERT_TRUE(parsed.ok()) << parsed.status();
    EXPECT_EQ(*parsed, resumed.state());
    resumed.state() = *std::move(parsed);
    resumed.Next(disc);
    EXPECT_EQ(resumed.result(), undisturbed.result());
  }
  State without = resumed.state();
  without.noise = {};
  EXPECT_EQ(SerializedBytes(resumed.state()),
            SerializedBytes(without) + 48 + 32 * resumed.state().noise.ids.size());
}

TEST(NoiseFilter, WrongStatesAreRefused) {
  RingStream stream(Filtering());
  Random random(11);
  for (int frame = 0; frame < 2; ++frame) stream.Next(ChangingDisc(frame, random));
  const std::string bytes = Serialize(stream.state());
  for (std::size_t k = 0; k < bytes.size(); k += 1 + bytes.size() / 997) {
    std::string changed = bytes;
    changed[k] = static_cast<char>(changed[k] ^ 0x10);
    EXPECT_FALSE(ParseState(changed).ok()) << k;
    EXPECT_FALSE(ParseState(bytes.substr(0, k)).ok()) << k;
  }
  EXPECT_FALSE(ParseState(bytes + '\0').ok());
  const auto expect_refused = [&](auto change) {
    State state = stream.state();
    change(state.noise);
    const auto violation = FindViolation(ParseState(Serialize(state)).status());
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation->reason, kReasonCorruptState);
  };
  expect_refused([](NoiseHistory& noise) { std::swap(noise.ids[3], noise.ids[4]); });
  expect_refused([](NoiseHistory& noise) { noise.ids[3] = noise.ids[4]; });
  expect_refused([](NoiseHistory& noise) { noise.given[3] = kNan; });
  expect_refused([](NoiseHistory& noise) { noise.offsets[3] = 5.5f; });
  expect_refused([](NoiseHistory& noise) { noise.offsets[3] = std::nanf(""); });
  expect_refused([](NoiseHistory& noise) { noise.offsets.pop_back(); });
  expect_refused([](NoiseHistory& noise) { noise.given.pop_back(); });
  expect_refused([](NoiseHistory& noise) { noise.ids.clear(); });
  // Three coordinates per particle belong to a stream in space.
  State in_space = stream.state();
  in_space.noise.given.resize(3 * in_space.noise.ids.size());
  in_space.noise.offsets.resize(in_space.noise.given.size());
  stream.state() = *ParseState(Serialize(in_space));
  const auto violation = FindViolation(stream.Try(ChangingDisc(2, random)));
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->reason, kReasonCorruptState);
}

TEST(NoiseFilter, BoxesChangeNothingForBodiesThatCrossThem) {
  ReconstructionParameters periodic = Filtering();
  periodic.box = PeriodicBox{.axes = {PeriodicAxis{0, 50}, PeriodicAxis{0, 45}}};
  RingStream open(Filtering()), boxed(periodic);
  Random random(12);
  for (int frame = 0; frame < 40; ++frame) {
    const Particles disc =
        WithIds(Shaken(support::Disc(8, 10 + 1.25 * frame, 20 + 1.5 * frame), .1, random));
    Particles wrapped = disc;
    for (std::size_t k = 0; k < wrapped.xy.size(); ++k) {
      const double length = k % 2 == 0 ? 50 : 45;
      wrapped.xy[k] -= length * std::floor(wrapped.xy[k] / length);
    }
    open.Next(disc);
    boxed.Next(wrapped);
    ASSERT_EQ(boxed.rings().RingCount(), 1u);
    // The cells of the box lie elsewhere, so the motions differ a little.
    for (const std::uint64_t id : disc.ids) {
      const auto in_box = OffsetOf(boxed.state(), id), expected = OffsetOf(open.state(), id);
      EXPECT_NEAR(in_box[0], expected[0], .1);
      EXPECT_NEAR(in_box[1], expected[1], .1);
    }
    EXPECT_LT(LargestOffset(boxed.state()), .5);
  }
}

TEST(NoiseFilter, CoordinatesAcrossThePlaneStay) {
  ReconstructionParameters parameters = Filtering();
  parameters.plane = Plane::kXz;
  RingStream in_space(parameters), flat(Filtering());
  Random random(13);
  for (int frame = 0; frame < 3; ++frame) {
    const Particles disc = ChangingDisc(frame, random);
    std::vector<double> xyz;
    for (std::size_t k = 0; k < disc.size(); ++k) {
      xyz.insert(xyz.end(), {disc.x(k), 5.0, disc.y(k)});
    }
    in_space.Next(
        Frame{.positions = std::span<const double>(xyz), .components = 3, .ids = disc.ids});
    flat.Next(disc);
    EXPECT_EQ(in_space.rings(), flat.rings());
    EXPECT_EQ(in_space.state().noise, flat.state().noise);
  }
}

}  // namespace
}  // namespace partiemc
